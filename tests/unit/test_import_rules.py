"""The repository's import rules hold, and their check can fail."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

CHECKOUT: Final = Path(__file__).resolve().parents[2]
PACKAGES: Final = ("wire", "server", "onboard_agent", "connect", "control_tower", "simulator")


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


BREACHES: Final = (
    ("wire/ids.py", "server.runtime.settings"),
    ("server/runtime/settings.py", "onboard_agent"),
    ("onboard_agent/link/backoff.py", "simulator"),
    ("onboard_agent/vision/concentric_squares.py", "time"),
    ("onboard_agent/vision/target_tracker.py", "numpy"),
    ("simulator/geodesy.py", "wire.ids"),
    ("wire/replay.py", "time"),
    ("server/live/hub.py", "asyncio"),
    ("server/live/hub.py", "server.storage.database"),
    ("server/control/core/lease.py", "sqlalchemy"),
    ("server/http/dependencies.py", "sqlalchemy"),
    ("server/app/composition.py", "alembic"),
    ("server/storage/database.py", "fastapi"),
    ("connect/session.py", "server.http.access"),
    ("connect/bridge.py", "asyncio"),
    ("control_tower/flight.py", "onboard_agent"),
    ("control_tower/flight_watch.py", "asyncio"),
    ("connect/rest.py", "control_tower.values"),
)


@pytest.fixture(scope="module")
def with_breaches(tmp_path_factory: pytest.TempPathFactory) -> subprocess.CompletedProcess[str]:
    """The check of a copy of the repository that has all these imports."""
    copy = tmp_path_factory.mktemp("copy")
    shutil.copyfile(CHECKOUT / "pyproject.toml", copy / "pyproject.toml")
    for package in PACKAGES:
        shutil.copytree(CHECKOUT / package, copy / package, ignore=shutil.ignore_patterns("__pycache__"))
    for file, imported in BREACHES:
        with (copy / file).open("a") as there:
            there.write(f"\nimport {imported}\n")
    return lint(copy)


def test_the_rules_hold() -> None:
    done = lint(CHECKOUT)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(("file", "imported"), BREACHES)
def test_a_breach_is_found(with_breaches: subprocess.CompletedProcess[str], file: str, imported: str) -> None:
    assert with_breaches.returncode == 1, with_breaches.stdout
    module = file.removesuffix(".py").replace("/", ".")
    assert f"{module} -> {imported} (l." in with_breaches.stdout


def test_the_dialect_is_imported_in_one_file_of_a_package_and_mavutil_nowhere() -> None:
    places = []
    for package in PACKAGES:
        for file in (CHECKOUT / package).rglob("*.py"):
            imports = [line for line in file.read_text().splitlines() if "import" in line and "pymavlink" in line]
            assert not any("mavutil" in line for line in imports), file
            places += [file.relative_to(CHECKOUT).as_posix()] * bool(imports)
    assert sorted(places) == ["simulator/dialect.py", "wire/dialect.py"]
