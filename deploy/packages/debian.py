"""Makes a package for Debian: a virtual environment at its final place, its units, and the scripts of dpkg.

The environment uses Debian's own Python, so it fits one minor version of it (`Depends`). Nothing of it is written by
pip's scripts: what is in it comes from `fill`.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

CHECKOUT: Final = Path(__file__).resolve().parents[2]
UPGRADE_PATIENCE_S: Final = 600
MAINTAINER: Final = "Control Tower developers <security@example.org>"


@dataclass(frozen=True)
class Package:
    """What a package holds. `home`: the environment's place. `commands`: name to `module:function`."""

    name: str
    summary: str
    home: Path
    commands: Mapping[str, str] = field(default_factory=dict)
    unit: str = ""
    settings: Mapping[str, str] = field(default_factory=dict)
    """Files below /etc that upgrades leave alone, by their path, with their content."""
    documents: tuple[str, ...] = ()
    depends: tuple[str, ...] = ()
    is_addition: bool = False
    """It adds packages to the environment of another one."""
    waits_for_disarm_of: str = ""
    """A unit: an upgrade replaces nothing while its drone is armed."""
    purged: tuple[str, ...] = ()
    """Folders that its programs made, and that go with a purge."""


TOWER: Final = Package(
    name="control-tower",
    summary="Ground station for many people flying many drones through the internet",
    home=Path("/opt/control-tower"),
    commands={"tower": "server.app.entry:main", "tower-sim": "simulator.cli:main"},
    unit="tower.service",
    settings={
        "/etc/control-tower/tower.env": "# Settings of the tower, one VARIABLE=value a line: see docs/settings.md.\n"
        "# TOWER_PUBLIC_URL=https://tower.example.org\n"
    },
    documents=("deploy/Caddyfile", "docs/settings.md", "docs/deploy.md"),
    depends=("ca-certificates",),
)
AGENT: Final = Package(
    name="control-tower-agent",
    summary="Agent of Control Tower: links a drone's autopilot with the tower",
    home=Path("/opt/tower-agent"),
    commands={"tower-agent": "onboard_agent.cli:main"},
    unit="tower-agent.service",
    documents=("deploy/agent.toml", "docs/agent.md"),
    depends=("ca-certificates",),
    waits_for_disarm_of="tower-agent.service",
    purged=("/etc/tower-agent", "/var/lib/private/tower-agent", "/var/lib/tower-agent"),
)
AGENT_VIDEO: Final = Package(
    name="control-tower-agent-video",
    summary="Cameras and encoders for the agent of Control Tower",
    home=AGENT.home,
    is_addition=True,
    waits_for_disarm_of=AGENT.unit,
)


def debian_version(version: str) -> str:
    """Python's versions as Debian sorts them: 0.3.0.dev0 and 0.3.0rc1 come before 0.3.0."""
    return re.sub(r"\.?(dev|a|b|rc)(\d+)$", r"~\1\2", version)


def build_deb(
    package: Package,
    *,
    version: str,
    architecture: str,
    python: str,
    fill: Callable[[Path], object],
    work: Path,
    out: Path,
    mark: str = "",
    compression: str = "xz",
) -> Path:
    """Returns the package's file. `python`: the minor version, as 3.11. `mark`: the system, at the end of the version.
    `fill` puts packages into the folder that it is called with."""
    full_version = debian_version(version) + (f"+{mark}" if mark else "")
    root = work / f"{package.name}_{architecture}"
    shutil.rmtree(root, ignore_errors=True)
    site = _below(root, package.home) / "lib" / f"python{python}" / "site-packages"
    site.mkdir(parents=True)
    fill(site)
    shutil.rmtree(site / "bin", ignore_errors=True)
    if not package.is_addition:
        _environment(root, package, python)
    if package.unit:
        _write(root / "usr/lib/systemd/system" / package.unit, (CHECKOUT / "deploy" / package.unit).read_text())
    for path, content in package.settings.items():
        _write(_below(root, Path(path)), content)
    for document in (*package.documents, "LICENSE"):
        _write(root / "usr/share/doc" / package.name / Path(document).name, (CHECKOUT / document).read_text())
    _control(root, package, version=full_version, architecture=architecture, python=python)
    made = out / f"{package.name}_{full_version}_{architecture}.deb"
    command = ["dpkg-deb", "--root-owner-group", f"-Z{compression}", "--build", str(root), str(made)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return made


def _environment(root: Path, package: Package, python: str) -> None:
    """A virtual environment is these files; `python -m venv` would write this machine's paths into them."""
    home = _below(root, package.home)
    _write(home / "pyvenv.cfg", f"home = /usr/bin\ninclude-system-site-packages = false\nversion = {python}\n")
    programs = home / "bin"
    programs.mkdir()
    for name in ("python", "python3", f"python{python}"):
        (programs / name).symlink_to(f"/usr/bin/python{python}")
    for name, where in package.commands.items():
        module, function = where.split(":")
        script = (
            f"#!{package.home}/bin/python -I\nimport sys\n\nfrom {module} import {function}\n\nsys.exit({function}())\n"
        )
        _write(programs / name, script, mode=0o755)
        link = root / "usr/bin" / name
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(package.home / "bin" / name)


def _control(root: Path, package: Package, *, version: str, architecture: str, python: str) -> None:
    folder = root / "DEBIAN"
    minor = int(python.split(".")[1])
    depends = [f"python3 (>= 3.{minor})", f"python3 (<< 3.{minor + 1})", *package.depends]
    if package.is_addition:
        depends = [f"{AGENT.name} (= {version})"]
    size = sum(path.lstat().st_size for path in root.rglob("*") if path.is_file() and not path.is_symlink())
    _write(
        folder / "control",
        f"Package: {package.name}\nVersion: {version}\nArchitecture: {architecture}\nMaintainer: {MAINTAINER}\n"
        f"Installed-Size: {size // 1024}\nDepends: {', '.join(depends)}\nSection: net\nPriority: optional\n"
        f"Description: {package.summary}\n",
    )
    if package.settings:
        _write(folder / "conffiles", "".join(f"{path}\n" for path in package.settings))
    if package.waits_for_disarm_of:
        _write(folder / "preinst", before_upgrade(package), mode=0o755)
    _write(folder / "postinst", _after_installation(package), mode=0o755)
    if package.purged:
        _write(folder / "postrm", _after_removal(package), mode=0o755)
    _write(folder / "prerm", _before_removal(package), mode=0o755)
    sums = "".join(
        f"{hashlib.md5(path.read_bytes(), usedforsecurity=False).hexdigest()}  {path.relative_to(root)}\n"
        for path in sorted(root.rglob("*"))
        if path.is_file() and not path.is_symlink() and folder not in path.parents
    )
    _write(folder / "md5sums", sums)


def before_upgrade(package: Package) -> str:
    """dpkg runs it before it replaces a file: an agent must not go on with half of another release in flight."""
    return f"""#!/bin/sh
set -e
armed() {{ systemctl show --property=StatusText --value {package.waits_for_disarm_of} | grep -q ', armed$'; }}
if [ "$1" = upgrade ] && [ -d /run/systemd/system ] && armed; then
  echo "The drone is armed: the upgrade waits until it is disarmed, {UPGRADE_PATIENCE_S // 60} minutes at most."
  waited=0
  while armed; do
    if [ $waited -ge {UPGRADE_PATIENCE_S} ]; then
      echo "The drone is still armed: nothing was changed. Upgrade when it is disarmed." >&2
      exit 1
    fi
    sleep 2
    waited=$((waited + 2))
  done
fi
"""


def _after_removal(package: Package) -> str:
    return f"""#!/bin/sh
set -e
if [ "$1" = purge ]; then
  rm -rf {" ".join(package.purged)}
fi
"""


def _after_installation(package: Package) -> str:
    # The service may not write there, and to compile everything at each start takes seconds and 60 MB.
    lines = [f"{package.home}/bin/python -m compileall -q {package.home}/lib || true"]
    if package.unit:
        lines += [
            "if [ -d /run/systemd/system ]; then",
            "  systemctl daemon-reload || true",
            f"  systemctl try-restart {package.unit} || true",
            "fi",
        ]
    return "#!/bin/sh\nset -e\n" + "\n".join(lines) + "\n"


def _before_removal(package: Package) -> str:
    lines = []
    if package.unit:
        lines += [
            'if [ "$1" = remove ] && [ -d /run/systemd/system ]; then',
            f"  systemctl disable --now {package.unit} || true",
            "fi",
        ]
    lines += [f"find {package.home}/lib -depth -name __pycache__ -exec rm -rf {{}} + || true"]
    return "#!/bin/sh\nset -e\n" + "\n".join(lines) + "\n"


def _write(path: Path, text: str, mode: int = 0o644) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    path.chmod(mode)
    # The package's content depends on the commit alone.
    moment = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    if moment:
        os.utime(path, (moment, moment))


def _below(root: Path, path: Path) -> Path:
    return root / path.relative_to("/")
