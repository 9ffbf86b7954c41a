"""For tests that fly a real ArduCopter: `ARDUCOPTER=/path/to/arducopter pytest tests/real`, on Linux."""

import os
from pathlib import Path

import pytest

VARIABLE = "ARDUCOPTER"


@pytest.fixture(scope="session")
def arducopter() -> Path:
    """The program of ArduCopter's own simulator. It is not part of this repository."""
    named = os.environ.get(VARIABLE)
    if not named:
        pytest.skip(f"flies a real autopilot only where {VARIABLE} names the program of ArduCopter's simulator")
    program = Path(named)
    if not os.access(program, os.X_OK):
        pytest.fail(f"{VARIABLE} names {program}, which is no program", pytrace=False)
    return program
