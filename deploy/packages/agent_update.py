"""Signs a release of the agent, so that drones accept it from their tower.

    python deploy/packages/agent_update.py new-key release.key     # makes a key; prints its public half, for agent.toml
    python deploy/packages/agent_update.py public-key release.key
    python deploy/packages/agent_update.py sign release.key dist/control_tower_agent-0.4.0-py3-none-any.whl [--out DIR]

Keep the key away from every tower: whoever has it can run code on every drone that trusts it.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import os
import sys
import zipfile
from email.parser import Parser
from pathlib import Path

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from wire.agent_update import DISTRIBUTION, PackageHead, make_package, text_to_sign


def new_key(path: Path) -> Ed25519PrivateKey:
    """Writes a new key to a file that nobody else can read. Raises FileExistsError."""
    key = Ed25519PrivateKey.generate()
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        file.write(base64.b64encode(key.private_bytes_raw()).decode() + "\n")
    return key


def read_key(path: Path) -> Ed25519PrivateKey:
    return Ed25519PrivateKey.from_private_bytes(base64.b64decode(path.read_text(), validate=False))


def public_text(key: Ed25519PrivateKey) -> str:
    """Returns what agents have in `release_keys`."""
    return base64.b64encode(key.public_key().public_bytes_raw()).decode()


def sign(payload: bytes, version: str, requires: tuple[str, ...], key: Ed25519PrivateKey) -> bytes:
    """Returns the package."""
    head = PackageHead(
        distribution=DISTRIBUTION,
        version=version,
        payload_bytes=len(payload),
        payload_sha256=hashlib.sha256(payload).hexdigest(),
        requires=requires,
    )
    return make_package(head, payload, key.sign(text_to_sign(head)))


def sign_wheel(wheel: Path, key: Ed25519PrivateKey, out: Path) -> Path:
    """Returns the package, which it writes into `out`."""
    with zipfile.ZipFile(wheel) as archive:
        name = next(one for one in archive.namelist() if one.endswith(".dist-info/METADATA"))
        metadata = Parser().parsestr(archive.read(name).decode())
    made = out / f"{DISTRIBUTION}-{metadata['Version']}.update"
    requires = tuple(metadata.get_all("Requires-Dist") or ())
    made.write_bytes(sign(wheel.read_bytes(), metadata["Version"], requires, key))
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description="Sign releases of the agent.")
    commands = parser.add_subparsers(dest="command", required=True)
    for name in ("new-key", "public-key", "sign"):
        command = commands.add_parser(name)
        command.add_argument("key", type=Path)
        if name == "sign":
            command.add_argument("wheel", type=Path)
            command.add_argument("--out", type=Path, default=Path())
    said = parser.parse_args()
    if said.command == "sign":
        print(sign_wheel(said.wheel, read_key(said.key), said.out))
    else:
        print(public_text(new_key(said.key) if said.command == "new-key" else read_key(said.key)))


if __name__ == "__main__":
    main()
