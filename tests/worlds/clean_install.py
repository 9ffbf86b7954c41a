"""Environments outside the checkout, with a built wheel and exactly what its metadata asks for.

The dependencies are hard links to what the checkout has installed. So it takes a second, needs no network, and a
dependency that the wheel does not declare is missing there as it would be anywhere.
"""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from email.parser import Parser
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement

CHECKOUT = Path(__file__).resolve().parents[2]
DOCKERFILES = {
    "control-tower": CHECKOUT / "deploy" / "Dockerfile.tower",
    "control-tower-agent": CHECKOUT / "deploy" / "Dockerfile.agent",
}


def build_wheels(folder: Path, *projects: str) -> dict[str, Path]:
    """Builds wheels as the container images do: from the files that the stage `wheel` copies, with its own command.
    Returns them by the names of their distributions."""
    return {name: _build_stage(DOCKERFILES[name], folder / name, name) for name in projects}


def _build_stage(dockerfile: Path, folder: Path, name: str) -> Path:
    stage = re.split(r"^FROM .*$", dockerfile.read_text(), flags=re.MULTILINE)[-2]
    for words in (line.split()[1:] for line in stage.splitlines() if line.startswith("COPY ")):
        sources = [one for one in words[:-1] if not one.startswith("--from=")]
        for source in (CHECKOUT / one.removeprefix("/build/") for one in sources):
            target = folder / (words[-1] if len(sources) == 1 and words[-1] != "./" else source.name)
            target.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(source, target)
    command = next(line for line in stage.splitlines() if line.startswith("RUN pip wheel "))
    words = [*command.removeprefix("RUN pip ").split(), "-q", "--disable-pip-version-check", "--no-index"]
    subprocess.run([sys.executable, "-m", "pip", *words], cwd=folder, check=True, timeout=120)
    return next((folder / "dist").glob(f"{name.replace('-', '_')}-[0-9]*.whl"))


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
    return write_programs(folder, wheel)


def write_programs(folder: Path, wheel: Path) -> Path:
    """Writes the wheel's console scripts into the environment. Returns their folder."""
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
