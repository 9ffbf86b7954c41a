"""Fixtures for tests with a real autopilot, on Linux: `ARDUCOPTER=/path/to/arducopter PX4=/path/to/build pytest
tests/real`.

PX4 is the folder of a SITL build (`build/px4_sitl_default`), with `bin/px4` and `etc/`.
"""

import os
from pathlib import Path

import pytest

VARIABLE = "ARDUCOPTER"
PX4_VARIABLE = "PX4"


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


@pytest.fixture(scope="session")
def px4_build() -> Path:
    """A build of PX4 that simulates its own quadcopter. It is not part of this repository."""
    named = os.environ.get(PX4_VARIABLE)
    if not named:
        pytest.skip(f"flies a real PX4 only where {PX4_VARIABLE} names the folder of a build of it")
    build = Path(named)
    if not os.access(build / "bin" / "px4", os.X_OK):
        pytest.fail(f"{PX4_VARIABLE} names {build}, in which there is no bin/px4", pytrace=False)
    return build
