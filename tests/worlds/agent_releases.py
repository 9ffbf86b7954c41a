"""Releases of the agent for tests: this checkout's agent under another version, signed, as it is or broken."""

import io
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from packages.agent_update import sign
from worlds.processes import CHECKOUT


def payload(version: str, files: Mapping[str, str] | None = None) -> bytes:
    """Returns what a wheel of that version holds. `files`: other contents, by their paths."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for folder in ("onboard_agent", "wire"):
            for path in sorted((CHECKOUT / folder).rglob("*.py")):
                name = str(path.relative_to(CHECKOUT))
                text = (files or {}).get(name) or path.read_text(encoding="utf-8")
                if name == "onboard_agent/__init__.py":
                    text = re.sub(r'(VERSION: Final = )"[^"]+"', rf'\1"{version}"', text)
                archive.writestr(name, text)
    return made.getvalue()


def write_release(
    folder: Path, version: str, key: Ed25519PrivateKey, files: Mapping[str, str] | None = None, *, spoil: bool = False
) -> Path:
    """Puts a release into the tower's folder. `spoil`: one byte is another than the signed one."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    content = bytearray(sign(payload(version, files), version, (), key))
    if spoil:
        content[len(content) // 2] ^= 1
    made = folder / f"control-tower-agent-{version}.update"
    made.write_bytes(content)
    return made
