"""Makes a folder of packages into a repository for apt, signed, that any web server can serve.

The packages stay where they are. `dists/CODENAME/` names those of one system by the end of their version (`+deb12`).
"""

from __future__ import annotations

import gzip
import hashlib
import subprocess
import tempfile
from dataclasses import dataclass
from email.utils import formatdate
from pathlib import Path
from typing import Final

PUBLIC_KEY: Final = "control-tower.asc"


@dataclass(frozen=True)
class System:
    """A system that packages are made for. `python`: its minor version; `glibc`: the minor version of its C library;
    `mark`: the end of its packages' versions."""

    codename: str
    title: str
    mark: str
    python: str
    glibc: int


SYSTEMS: Final = (
    System("bookworm", "Debian 12 and Raspberry Pi OS 12", "deb12", "3.11", 36),
    System("trixie", "Debian 13 and Raspberry Pi OS 13", "deb13", "3.13", 41),
    System("noble", "Ubuntu 24.04", "ubuntu24.04", "3.12", 39),
)


def make_repository(folder: Path, *, made_at_s: int, secret_key: Path | None) -> None:
    """`made_at_s`: Unix time. `secret_key`: an OpenPGP key without a passphrase; None: the repository is not signed.

    Raises CalledProcessError: a package cannot be read, or the key does not sign.
    """
    packages = [_entry(deb, folder) for deb in sorted(folder.glob("*.deb"))]
    for system in SYSTEMS:
        ours = [one for one in packages if one["Version"].endswith(f"+{system.mark}")]
        if ours:
            _write_suite(folder / "dists" / system.codename, system, ours, made_at_s)
    if secret_key is not None:
        _sign(folder, secret_key)


def _entry(deb: Path, folder: Path) -> dict[str, str]:
    asked = subprocess.run(["dpkg-deb", "--field", str(deb)], check=True, capture_output=True, text=True).stdout
    fields = dict(line.split(": ", 1) for line in asked.splitlines())
    content = deb.read_bytes()
    return fields | {
        "Filename": str(deb.relative_to(folder)),
        "Size": str(len(content)),
        "SHA256": hashlib.sha256(content).hexdigest(),
    }


def _write_suite(suite: Path, system: System, packages: list[dict[str, str]], made_at_s: int) -> None:
    architectures = sorted({one["Architecture"] for one in packages})
    for architecture in architectures:
        index = suite / "main" / f"binary-{architecture}" / "Packages"
        index.parent.mkdir(parents=True, exist_ok=True)
        ours = [one for one in packages if one["Architecture"] == architecture]
        index.write_text("\n".join("".join(f"{key}: {value}\n" for key, value in one.items()) for one in ours))
        index.with_suffix(".gz").write_bytes(gzip.compress(index.read_bytes(), mtime=0))
    files = sorted(path for path in suite.rglob("Packages*") if path.is_file())
    sums = "".join(
        f" {hashlib.sha256(path.read_bytes()).hexdigest()} {path.stat().st_size} {path.relative_to(suite)}\n"
        for path in files
    )
    (suite / "Release").write_text(
        f"Origin: Control Tower\nLabel: Control Tower\nSuite: {system.codename}\nCodename: {system.codename}\n"
        f"Date: {formatdate(made_at_s, usegmt=True)}\nArchitectures: {' '.join(architectures)}\nComponents: main\n"
        f"Description: Control Tower for {system.title}\nSHA256:\n{sums}"
    )


def _sign(folder: Path, secret_key: Path) -> None:
    with tempfile.TemporaryDirectory(prefix="tower-gpg-") as home:
        gpg = ("gpg", "--homedir", home, "--batch", "--yes", "--quiet")
        subprocess.run((*gpg, "--import", str(secret_key)), check=True)
        for release in folder.glob("dists/*/Release"):
            signed = release.with_name("InRelease")
            subprocess.run(
                (*gpg, "--digest-algo", "SHA512", "--clearsign", "-o", str(signed), str(release)), check=True
            )
        exported = subprocess.run((*gpg, "--armor", "--export"), check=True, capture_output=True)
        (folder / PUBLIC_KEY).write_bytes(exported.stdout)
        subprocess.run(("gpgconf", "--homedir", home, "--kill", "all"), check=False)
