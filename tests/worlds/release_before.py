"""The agent of release 0.2.0, from a wheel that is built from that release's own files in this repository's history.

It has an environment of its own, outside the checkout. The packages that it needs are those that the checkout has.
"""

import io
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path
from typing import Final

import pytest
from worlds.clean_install import CHECKOUT, write_programs

VERSION: Final = "0.2.0"
COMMIT: Final = "906a4e4e"
"""Version 0.2.0 under the Apache License 2.0."""
PACKAGES: Final = ("wire", "server", "onboard_agent", "connect", "simulator")
TAKES: Final = frozenset({"transactions", "follow", "follow_person", "open-holds", "video"})
"""What its hello lists; `video` with a camera only."""


def release_before(folder: Path) -> Path:
    """Builds its wheel and installs it below `folder`. Returns the folder of its programs. Skips without history."""
    found = subprocess.run(
        ["git", "archive", COMMIT, "pyproject.toml", "README.md", "LICENSE", *PACKAGES],
        cwd=CHECKOUT,
        capture_output=True,
        check=False,
    )
    if found.returncode != 0:
        pytest.skip(f"the history of release {VERSION} ({COMMIT}) is not in this clone: git fetch --unshallow")
    source = folder / "source"
    with tarfile.open(fileobj=io.BytesIO(found.stdout)) as archive:
        archive.extractall(source, filter="data")
    command = ("-m", "pip", "wheel", "-q", "--disable-pip-version-check", "--no-deps", "--no-build-isolation", "-w")
    subprocess.run([sys.executable, *command, str(folder), str(source)], check=True, timeout=120)
    return _install(folder / "environment", next(folder.glob(f"control_tower-{VERSION}-*.whl")))


def _install(folder: Path, wheel: Path) -> Path:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True, timeout=60)
    site = folder / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    # A folder that is named in a .pth file has no .pth files of its own: nothing leads back to the checkout.
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return write_programs(folder, wheel)
