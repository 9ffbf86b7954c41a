"""The parameters for safe flight without a radio receiver, and the messages about them."""

import pytest

from server.control.core.receiver_setup import ReceiverSetup, receiver_setup
from wire.control_messages import LossParameters

COPTER = {"FS_THR_ENABLE": 1.0, "FS_OPTIONS": 16.0, "RC_OVERRIDE_TIME": 3.0}
STATION = {"FS_GCS_ENABLE": 0.0, "FS_GCS_TIMEOUT": 5.0}
PX4 = {"COM_RC_IN_MODE": 1.0, "NAV_RCL_ACT": 2.0, "COM_RCL_EXCEPT": 0.0, "COM_OBL_RC_ACT": 5.0}


def setup_of(values: dict[str, float], autopilot: str = "ardupilot", has_radio: bool | None = False) -> ReceiverSetup:
    return receiver_setup(LossParameters(autopilot=autopilot, values=values, complete=True, has_radio=has_radio))


@pytest.mark.parametrize(
    ("autopilot", "values", "to_write"),
    [
        ("ardupilot", COPTER, {"FS_OPTIONS": 29.0}),
        ("ardupilot", COPTER | {"FS_OPTIONS": 29.0}, {}),
        ("ardupilot", COPTER | {"FS_OPTIONS": 31.0, "FS_THR_ENABLE": 0.0}, {"FS_THR_ENABLE": 1.0}),
        ("ardupilot", COPTER | {"FS_OPTIONS": 13.0, "FS_THR_ENABLE": 3.0}, {"FS_THR_ENABLE": 1.0}),
        ("ardupilot", COPTER | {"FS_OPTIONS": 13.0, "RC_OVERRIDE_TIME": 0.0}, {"RC_OVERRIDE_TIME": 3.0}),
        ("ardupilot", COPTER | {"FS_OPTIONS": 13.0, "RC_OVERRIDE_TIME": -1.0}, {"RC_OVERRIDE_TIME": 3.0}),
        ("ardupilot", COPTER | {"FS_OPTIONS": 13.0, "RC_OVERRIDE_TIME": 10.5}, {"RC_OVERRIDE_TIME": 3.0}),
        ("ardupilot", COPTER | {"FS_OPTIONS": 13.0, "RC_OVERRIDE_TIME": 1.5}, {}),
        ("px4", PX4, {"COM_RCL_EXCEPT": 7.0}),
        ("px4", PX4 | {"COM_RCL_EXCEPT": 7.0, "COM_OBL_RC_ACT": 0.0}, {"COM_OBL_RC_ACT": 5.0}),
        ("px4", PX4 | {"COM_RCL_EXCEPT": 7.0, "COM_OBL_RC_ACT": 4.0}, {}),
        ("px4", PX4 | {"COM_RCL_EXCEPT": 7.0, "NAV_RCL_ACT": 0.0}, {"NAV_RCL_ACT": 2.0}),
        ("px4", PX4 | {"COM_RCL_EXCEPT": 15.0, "NAV_RCL_ACT": 3.0, "COM_RC_IN_MODE": 0.0}, {"COM_RC_IN_MODE": 1.0}),
    ],
)
def test_what_is_to_be_written(autopilot: str, values: dict[str, float], to_write: dict[str, float]) -> None:
    setup = setup_of(values, autopilot)
    assert setup.to_write == to_write
    assert (setup.known, setup.needed) == (True, bool(to_write))
    written = setup_of(values | to_write, autopilot)
    assert not written.needed
    assert "is set up to fly without one" in written.text


@pytest.mark.parametrize(
    ("values", "to_write"),
    [
        ({}, {"FS_GCS_ENABLE": 1.0, "FS_OPTIONS": 2.0}),
        ({"FS_GCS_ENABLE": 5.0, "FS_OPTIONS": 2.0}, {}),
        (
            {"FS_GCS_ENABLE": 1.0, "FS_OPTIONS": 29.0, "FS_GCS_TIMEOUT": 60.0},
            {"FS_OPTIONS": 15.0, "FS_GCS_TIMEOUT": 5.0},
        ),
        ({"RC_OVERRIDE_TIME": -1.0}, {"FS_GCS_ENABLE": 1.0, "FS_OPTIONS": 2.0, "RC_OVERRIDE_TIME": 3.0}),
    ],
)
def test_what_is_to_be_written_with_a_receiver(values: dict[str, float], to_write: dict[str, float]) -> None:
    setup = setup_of(COPTER | STATION | values, has_radio=True)
    assert setup.to_write == to_write
    assert not setup_of(COPTER | STATION | values | to_write, has_radio=True).needed


def test_px4_has_none_with_a_receiver() -> None:
    setup = setup_of(PX4, "px4", has_radio=True)
    assert (setup.rows, setup.needed) == ((), False)
    assert setup.text.startswith("This set-up exists for ArduPilot only")


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_each_row_is_explained_in_a_short_sentence(autopilot: str) -> None:
    for row in setup_of({}, autopilot).rows:
        assert row.why.endswith(".") and len(row.why) < 100
        assert (row.now, row.ok) == (None, False)


@pytest.mark.parametrize(
    ("has_radio", "values", "needed", "known", "words"),
    [
        (True, COPTER | STATION, True, True, "not set up for a failure of the computer"),
        (True, COPTER | STATION | {"FS_GCS_ENABLE": 5.0, "FS_OPTIONS": 2.0}, False, True, "is set up for a failure"),
        (True, COPTER, True, False, "not all relevant parameters"),
        (None, COPTER, False, True, "not known whether"),
        (False, COPTER, True, True, "not set up"),
        (False, {"FS_THR_ENABLE": 1.0}, True, False, "not all relevant parameters"),
        (False, COPTER | {"FS_OPTIONS": float("nan")}, True, False, "not all relevant parameters"),
    ],
)
def test_what_is_said(has_radio: bool | None, values: dict[str, float], needed: bool, known: bool, words: str) -> None:
    setup = setup_of(values, has_radio=has_radio)
    assert (setup.needed, setup.known) == (needed, known)
    assert words in setup.text


@pytest.mark.parametrize("parameters", [None, LossParameters(autopilot="", values={}, complete=True, has_radio=False)])
def test_another_autopilot_has_no_rows(parameters: LossParameters | None) -> None:
    setup = receiver_setup(parameters)
    assert (setup.rows, setup.needed, setup.known, setup.autopilot) == ((), False, False, "")
