"""`make release`: everything that is released, into dist/, by one command.

    python deploy/release.py [--out dist] [--architecture amd64 --architecture arm64] [--system trixie] [--untested]

Wheels of tower, agent, SDK and `tower-connect`, packages for each system and architecture in a repository for apt
(signed where TOWER_REPOSITORY_KEY names a key), bills of materials (CycloneDX), the example of the agent's settings,
the agent's signed update where TOWER_RELEASE_KEY names a key, and SHA256SUMS over all. The packages hold the versions
of `requirements/*.txt`, by their hashes; wheels of another architecture are fetched as they are, and nothing is
compiled.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from packaging.markers import Marker

sys.path.insert(0, str(Path(__file__).parent))

from packages.agent_update import read_key, sign_wheel
from packages.bill_of_materials import bill_of_materials
from packages.debian import AGENT, AGENT_VIDEO, CHECKOUT, TOWER, Package, build_deb
from packages.long_stamp import NotTested, require_stamp
from packages.repository import SYSTEMS, System, make_repository

PLATFORMS: Final = {"amd64": "x86_64", "arm64": "aarch64", "armhf": "armv7l"}
"""Debian's names, and those of wheels."""
RELEASE_KEY: Final = "TOWER_RELEASE_KEY"
"""File of the key that signs the agent's update (packages/agent_update.py)."""
REPOSITORY_KEY: Final = "TOWER_REPOSITORY_KEY"
"""File of the OpenPGP key that signs the repository."""
_OLDEST_GLIBC: Final = 17
"""Minor version of the oldest C library that wheels are made for."""
SDK: Final = "control-tower-sdk"
CONNECT: Final = "control-tower-connect"
"""Wheels alone: who uses them has Python."""
LOCKS: Final = {TOWER.name: "tower.txt", AGENT.name: "agent.txt", AGENT_VIDEO.name: "agent-video.txt"}
PIP: Final = (sys.executable, "-m", "pip", "--disable-pip-version-check", "-q")


class CannotRelease(Exception):
    """One line: what is wrong."""


def main() -> int:
    said = _arguments()
    if not said.untested:
        try:
            print(f"the long tests passed at {require_stamp()}")
        except NotTested as error:
            print(f"release: {error}", file=sys.stderr)
            return 1
    out: Path = said.out
    os.environ.setdefault("SOURCE_DATE_EPOCH", _git("log", "-1", "--format=%ct"))
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    try:
        wheels = build_wheels(out)
        version = wheels[TOWER.name].name.split("-")[1]
        _bills(out, version)
        shutil.copy(CHECKOUT / "deploy" / "agent.toml", out / "agent.toml")
        _sign(wheels[AGENT.name], out)
        with tempfile.TemporaryDirectory(prefix="tower-release-") as work:
            for system in (one for one in SYSTEMS if one.codename in (said.system or [one.codename])):
                for architecture in said.architecture or ["amd64", "arm64"]:
                    for package in (TOWER, AGENT, AGENT_VIDEO):
                        _deb(package, wheels, version, architecture, system, Path(work), out)
        _repository(out)
    except (CannotRelease, subprocess.CalledProcessError) as error:
        print(f"release: {error}", file=sys.stderr)
        return 1
    write_sums(out)
    print(f"{len(list(out.iterdir()))} files of version {version} are in {out}")
    return 0


def _sign(wheel: Path, out: Path) -> None:
    """Makes the agent's update, if the environment names the release key."""
    key = os.environ.get(RELEASE_KEY)
    if key is None:
        print(f"not signed: {RELEASE_KEY} names no key, so that no tower can update an agent to this release")
        return
    try:
        sign_wheel(wheel, read_key(Path(key)), out)
    except (OSError, ValueError) as error:
        raise CannotRelease(f"{RELEASE_KEY}={key}: {error}") from None


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Build everything that is released.")
    parser.add_argument("--out", type=Path, default=CHECKOUT / "dist")
    parser.add_argument("--architecture", action="append", choices=sorted(PLATFORMS), help="Default: amd64 and arm64.")
    systems = [one.codename for one in SYSTEMS]
    parser.add_argument("--system", action="append", choices=systems, help=f"Default: {', '.join(systems)}.")
    parser.add_argument("--untested", action="store_true", help="Build also what did not pass `make test-long`.")
    return parser.parse_args()


def build_wheels(out: Path) -> dict[str, Path]:
    """Builds the wheels. Returns them by the names of their distributions."""
    packages = CHECKOUT / "deploy" / "packages"
    sources = {TOWER.name: CHECKOUT} | {
        name: packages / folder for name, folder in ((AGENT.name, "agent"), (SDK, "sdk"), (CONNECT, "connect"))
    }
    command = (*PIP, "wheel", "--no-deps", "--no-build-isolation", "-w", str(out), *map(str, sources.values()))
    subprocess.run(command, check=True)
    return {name: next(out.glob(f"{name.replace('-', '_')}-[0-9]*.whl")) for name in sources}


def _repository(out: Path) -> None:
    key = os.environ.get(REPOSITORY_KEY)
    if key is None:
        print(f"the repository is not signed: {REPOSITORY_KEY} names no key, so that apt refuses it")
    made_at_s = int(os.environ["SOURCE_DATE_EPOCH"])
    make_repository(out, made_at_s=made_at_s, secret_key=None if key is None else Path(key))


def _deb(
    package: Package, wheels: dict[str, Path], version: str, architecture: str, system: System, work: Path, out: Path
) -> None:
    try:
        fill = filler(package, wheels.get(package.name), architecture, system, work)
        build_deb(
            package,
            version=version,
            architecture=architecture,
            python=system.python,
            mark=system.mark,
            fill=fill,
            work=work,
            out=out,
        )
    except subprocess.CalledProcessError as error:
        where = f"{system.title}, {architecture}"
        raise CannotRelease(f"{package.name} for {where}: {error}. Has every package a wheel for it?") from None


def filler(
    package: Package, wheel: Path | None, architecture: str, system: System, work: Path
) -> Callable[[Path], object]:
    """Returns what puts a package's content into its folder."""
    machine = PLATFORMS[architecture]
    locks = CHECKOUT / "requirements"
    entries = entries_for(locks / LOCKS[package.name], system.python, machine)
    if package is AGENT_VIDEO:
        base = entries_for(locks / LOCKS[AGENT.name], system.python, machine)
        entries = [one for one in entries if one not in base]
    lock = work / f"{package.name}.txt"
    lock.write_text("\n".join(entries) + "\n", encoding="utf-8")
    tags = [
        word
        for minor in range(_OLDEST_GLIBC, system.glibc + 1)
        for word in ("--platform", f"manylinux_2_{minor}_{machine}")
    ]
    old = ("--platform", f"manylinux2014_{machine}")
    target = (*old, *tags, "--python-version", system.python, "--implementation", "cp")

    def fill(site: Path) -> None:
        install = (*PIP, "install", "--target", str(site), "--no-compile", "--only-binary", ":all:", *target)
        install += ("--ignore-requires-python",)  # pip compares it with its own Python, too
        subprocess.run((*install, "--no-deps", "--require-hashes", "-r", str(lock)), check=True)
        if wheel is not None:
            subprocess.run((*install, "--no-deps", "--upgrade", str(wheel)), check=True)

    return fill


def entries_for(lock: Path, python: str, machine: str) -> list[str]:
    """Returns the entries of a lock file that a system needs, without their conditions: pip asks those of the Python
    that it runs on, and not of the target."""
    environment = {
        "python_version": python,
        "python_full_version": f"{python}.0",
        "platform_machine": machine,
        "sys_platform": "linux",
        "platform_system": "Linux",
        "os_name": "posix",
        "implementation_name": "cpython",
        "platform_python_implementation": "CPython",
    }
    found = []
    for entry in re.split(r"\n(?=\S)", lock.read_text(encoding="utf-8").strip()):
        pinned, has_condition, rest = entry.partition(" ; ")
        if not has_condition:
            found.append(entry)
            continue
        condition, _, hashes = rest.partition(" \\\n")
        if Marker(condition).evaluate(environment):
            found.append(f"{pinned} \\\n{hashes}")
    return found


def _bills(out: Path, version: str) -> None:
    moment = datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), UTC).isoformat()
    for package, lock, console in (
        (TOWER, "tower.txt", CHECKOUT / "web" / "package-lock.json"),
        (AGENT, "agent-video.txt", None),
    ):
        made = bill_of_materials(
            package.name, version, CHECKOUT / "requirements" / lock, moment=moment, console=console
        )
        (out / f"{package.name}-{version}.cdx.json").write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")


def write_sums(out: Path) -> None:
    """Writes SHA256SUMS, for `sha256sum --check`."""
    files = sorted(path for path in out.iterdir() if path.name != "SHA256SUMS")
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files]
    (out / "SHA256SUMS").write_text("".join(lines), encoding="utf-8")


def _git(*words: str) -> str:
    return subprocess.run(("git", *words), cwd=CHECKOUT, check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
