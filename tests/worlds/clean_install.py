"""Environments outside the checkout, with a built wheel and exactly what its metadata asks for.

The dependencies are hard links to what the checkout has installed. So it takes a second, needs no network, and a
dependency that the wheel does not declare is missing there as it would be anywhere.
"""

import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from email.parser import Parser
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement

CHECKOUT = Path(__file__).resolve().parents[2]
PROJECTS = {"control-tower": CHECKOUT, "control-tower-agent": CHECKOUT / "deploy" / "packages" / "agent"}


def build_wheels(folder: Path, *projects: str) -> dict[str, Path]:
    """Builds the wheels as the release does. Returns them by the names of their distributions."""
    sources = [str(PROJECTS[name]) for name in projects]
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--disable-pip-version-check", "--no-deps", "--no-index"]
    subprocess.run([*command, "--no-build-isolation", "-w", str(folder), *sources], check=True, timeout=120)
    return {name: next(folder.glob(f"{name.replace('-', '_')}-[0-9]*.whl")) for name in projects}


def closure(wheel: Path, extra: str = "") -> list[Distribution]:
    """Returns what the wheel needs, and what that needs, as installed here. Fails if a version here does not fit."""
    found: dict[str, Distribution] = {}
    waiting = [(one, extra) for one in _requirements_of_wheel(wheel)]
    while waiting:
        text, wanted = waiting.pop()
        one = Requirement(text)
        if one.marker is not None and not one.marker.evaluate({"extra": wanted}):
            continue
        name = re.sub(r"[-_.]+", "-", one.name).lower()
        installed = found.get(name) or distribution(one.name)
        assert one.specifier.contains(installed.version, prereleases=True), (text, installed.version)
        if name not in found or one.extras:
            found[name] = installed
            waiting += [(text, inner) for text in installed.requires or () for inner in ("", *one.extras)]
    return list(found.values())


def _requirements_of_wheel(wheel: Path) -> list[str]:
    with zipfile.ZipFile(wheel) as archive:
        metadata = next(name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return Parser().parsestr(archive.read(metadata).decode()).get_all("Requires-Dist") or []


def fill(site: Path, wheel: Path, extra: str = "") -> None:
    """Puts the wheel and what it needs into a folder of packages."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    for one in closure(wheel, extra):
        for source, target in _files(one, site):
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.link(source, target)
            except OSError:  # another file system
                target.write_bytes(source.read_bytes())


def _files(one: Distribution, site: Path) -> Iterator[tuple[Path, Path]]:
    for file in one.files or ():
        source = Path(str(file.locate()))
        # Scripts lie beside, and are not needed.
        if ".." not in file.parts and source.is_file():
            yield source, site / str(file)


def install(folder: Path, wheel: Path, extra: str = "") -> Path:
    """Makes an environment of its own with the wheel. Returns its folder of programs."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True, timeout=60)
    site = folder / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
    fill(site, wheel, extra)
    # As pip does: a program that compiles itself takes twice the memory ever after.
    subprocess.run([folder / "bin" / "python", "-m", "compileall", "-q", str(site)], check=True, timeout=120)
    for name, where in _programs(wheel):
        module, function = where.split(":")
        script = folder / "bin" / name
        script.write_text(
            f"#!{folder}/bin/python\nimport sys\nfrom {module} import {function}\nsys.exit({function}())\n"
        )
        script.chmod(0o755)
    return folder / "bin"


def _programs(wheel: Path) -> list[tuple[str, str]]:
    with zipfile.ZipFile(wheel) as archive:
        points = next(name for name in archive.namelist() if name.endswith("entry_points.txt"))
        lines = archive.read(points).decode().splitlines()
    return [(name.strip(), where.strip()) for name, _, where in (line.partition("=") for line in lines) if where]
