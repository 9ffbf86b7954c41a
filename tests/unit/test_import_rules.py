"""The repository's import rules hold, and their check can fail."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

CHECKOUT: Final = Path(__file__).resolve().parents[2]
PACKAGES: Final = ("wire", "server", "onboard_agent", "connect", "simulator")


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    shutil.copyfile(CHECKOUT / "pyproject.toml", tmp_path / "pyproject.toml")
    for package in PACKAGES:
        shutil.copytree(CHECKOUT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def test_the_rules_hold() -> None:
    done = lint(CHECKOUT)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("wire/ids.py", "import server.runtime.settings"),
        ("server/runtime/settings.py", "import onboard_agent"),
        ("onboard_agent/link/backoff.py", "import simulator"),
        ("simulator/geodesy.py", "import wire.ids"),
        ("wire/replay.py", "import time"),
        ("server/live/hub.py", "import asyncio"),
        ("server/domain/lease.py", "import sqlalchemy"),
        ("connect/session.py", "import server.api.access"),
        ("connect/bridge.py", "import asyncio"),
    ],
)
def test_a_breach_is_found(copy: Path, file: str, line: str) -> None:
    place = copy / file
    place.write_text(place.read_text() + f"\n{line}\n")
    done = lint(copy)
    assert done.returncode == 1, done.stdout
    assert "BROKEN" in done.stdout


def test_the_dialect_is_imported_in_one_file_of_a_package_and_mavutil_nowhere() -> None:
    places = []
    for package in PACKAGES:
        for file in (CHECKOUT / package).rglob("*.py"):
            imports = [line for line in file.read_text().splitlines() if "import" in line and "pymavlink" in line]
            assert not any("mavutil" in line for line in imports), file
            places += [file.relative_to(CHECKOUT).as_posix()] * bool(imports)
    assert sorted(places) == ["simulator/dialect.py", "wire/dialect.py"]
