"""For all tests: a part that is missing is a failure in CI, and a skip with the reason elsewhere."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

CHROMIUM_NAMES: Final = ("chromium", "chromium-browser", "google-chrome")
CONSOLE: Final = Path(__file__).resolve().parent.parent / "web" / "dist" / "index.html"


@pytest.fixture(scope="session")
def missing() -> Callable[[str], None]:
    """Call it with the name of a part that is not there, and how to get it."""

    def say(part: str) -> None:
        if os.environ.get("CI"):
            pytest.fail(f"this test needs {part}", pytrace=False)
        pytest.skip(f"this test needs {part}")

    return say


@pytest.fixture(scope="session")
def chromium_path(missing: Callable[[str], None]) -> str:
    """The system's Chromium."""
    found = next((path for name in CHROMIUM_NAMES if (path := shutil.which(name))), None)
    if found is None:
        missing("Chromium (Debian: apt-get install chromium)")
    assert found is not None
    return found


@pytest.fixture(scope="session")
def console(missing: Callable[[str], None]) -> Path:
    """The built console."""
    if not CONSOLE.exists():
        missing("the console, built (make setup)")
    return CONSOLE
