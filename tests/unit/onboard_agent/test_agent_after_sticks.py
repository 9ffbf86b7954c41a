"""What the autopilot does when sticks stop: a row for each case measured on ArduCopter, and PX4's parameters."""

import pytest

from onboard_agent.failsafe.after_sticks import after_sticks
from wire.autopilots.px4_multicopter import custom_mode as px4_custom_mode
from wire.dialect import mavlink
from wire.open_holds import AfterSticks

ARDUPILOT, PX4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4
STABILIZE, ALT_HOLD, AUTO, GUIDED, LOITER, RTL, LAND, POSHOLD, BRAKE = 0, 2, 3, 4, 5, 6, 9, 16, 17
STAYS, SINKS, RETURNS, LANDS, UNKNOWN = (
    AfterSticks.STAYS,
    AfterSticks.SINKS,
    AfterSticks.RETURNS,
    AfterSticks.LANDS,
    AfterSticks.UNKNOWN,
)


@pytest.mark.parametrize(
    ("mode", "throttle_failsafe", "options", "expected"),
    [
        (BRAKE, 1, 16, RETURNS),
        (BRAKE, 1, 20, RETURNS),
        (BRAKE, 1, 29, RETURNS),
        (BRAKE, 0, 16, STAYS),
        (GUIDED, 1, 16, RETURNS),
        (GUIDED, 1, 20, STAYS),
        (GUIDED, 1, 29, STAYS),
        (GUIDED, 0, 16, STAYS),
        (AUTO, 1, 16, RETURNS),
        (AUTO, 1, 29, STAYS),
        (AUTO, 2, 16, STAYS),
        (RTL, 1, 16, RETURNS),
        (RTL, 1, 29, RETURNS),
        (LAND, 1, 16, RETURNS),
        (LAND, 1, 29, STAYS),
        (ALT_HOLD, 1, 16, RETURNS),
        (ALT_HOLD, 1, 29, RETURNS),
        # The last sticks stay in force for ever.
        (ALT_HOLD, 0, 16, UNKNOWN),
        (LOITER, 0, 29, UNKNOWN),
        (GUIDED, 3, 16, LANDS),
        (BRAKE, 3, 29, LANDS),
        (BRAKE, 4, 16, RETURNS),
        (BRAKE, 5, 16, LANDS),
        (BRAKE, 99, 16, UNKNOWN),
    ],
)
def test_ardupilot_without_a_receiver(mode: int, throttle_failsafe: int, options: int, expected: AfterSticks) -> None:
    values = {"FS_THR_ENABLE": float(throttle_failsafe), "FS_OPTIONS": float(options)}
    assert after_sticks(ARDUPILOT, mode, values=values, has_radio=False) is expected


@pytest.mark.parametrize("mode", [AUTO, GUIDED, RTL, LAND, BRAKE])
@pytest.mark.parametrize("throttle_failsafe", [0, 1, 3])
def test_with_a_receiver_what_uses_no_sticks_stays(mode: int, throttle_failsafe: int) -> None:
    values = {"FS_THR_ENABLE": float(throttle_failsafe), "FS_OPTIONS": 16.0}
    assert after_sticks(ARDUPILOT, mode, values=values, has_radio=True) is STAYS


@pytest.mark.parametrize(
    ("mode", "values", "expected"),
    [
        (BRAKE, {"FS_THR_ENABLE": 1.0, "FS_OPTIONS": 16.0}, UNKNOWN),
        (BRAKE, {"FS_THR_ENABLE": 3.0, "FS_OPTIONS": 29.0}, UNKNOWN),
        (BRAKE, {"FS_THR_ENABLE": 0.0, "FS_OPTIONS": 16.0}, STAYS),
        (BRAKE, {}, UNKNOWN),
        (GUIDED, {"FS_THR_ENABLE": 1.0, "FS_OPTIONS": 20.0}, STAYS),
        (GUIDED, {"FS_THR_ENABLE": 1.0, "FS_OPTIONS": 16.0}, UNKNOWN),
        (ALT_HOLD, {"FS_THR_ENABLE": 1.0, "FS_OPTIONS": 16.0}, SINKS),
    ],
)
def test_a_receiver_that_sticks_hide_may_have_lost_its_transmitter(
    mode: int, values: dict[str, float], expected: AfterSticks
) -> None:
    assert after_sticks(ARDUPILOT, mode, values=values, has_radio=True, hidden=True) is expected


@pytest.mark.parametrize("mode", [STABILIZE, ALT_HOLD, LOITER, POSHOLD, 99])
@pytest.mark.parametrize("kind", [ARDUPILOT, PX4])
def test_with_a_receiver_what_uses_sticks_sinks_with_its_resting_throttle(kind: int, mode: int) -> None:
    custom_mode = mode if kind == ARDUPILOT else px4_custom_mode(3, 0)
    assert after_sticks(kind, custom_mode, values={}, has_radio=True) is SINKS


@pytest.mark.parametrize("kind", [ARDUPILOT, PX4])
@pytest.mark.parametrize(
    ("values", "has_radio"),
    [
        ({"FS_THR_ENABLE": 0.0, "NAV_RCL_ACT": 0.0, "FS_OPTIONS": 29.0}, None),
        ({}, False),
        ({"FS_OPTIONS": 29.0, "COM_RCL_EXCEPT": 7.0}, False),
    ],
)
def test_what_is_not_known_is_said_to_be_unknown(kind: int, values: dict[str, float], has_radio: bool | None) -> None:
    mode = BRAKE if kind == ARDUPILOT else px4_custom_mode(4, 3)
    assert after_sticks(kind, mode, values=values, has_radio=has_radio) is UNKNOWN


def test_options_that_were_not_read_except_nothing() -> None:
    assert after_sticks(ARDUPILOT, GUIDED, values={"FS_THR_ENABLE": 1.0}, has_radio=False) is RETURNS


MISSION, HOLD, OFFBOARD, RETURN, LAND, TAKE_OFF = (
    px4_custom_mode(4, 4),
    px4_custom_mode(4, 3),
    px4_custom_mode(6, 0),
    px4_custom_mode(4, 5),
    px4_custom_mode(4, 6),
    px4_custom_mode(4, 2),
)
POSCTL = px4_custom_mode(3, 0)


@pytest.mark.parametrize(
    ("mode", "action", "exceptions", "expected"),
    [
        (HOLD, 2, 0, RETURNS),
        (HOLD, 2, 2, STAYS),
        (HOLD, 2, 1, RETURNS),
        (MISSION, 2, 1, STAYS),
        (MISSION, 2, 6, RETURNS),
        (OFFBOARD, 2, 4, STAYS),
        (RETURN, 2, 0, STAYS),
        (RETURN, 3, 0, LANDS),
        (LAND, 3, 0, STAYS),
        (TAKE_OFF, 2, 2, STAYS),
        (HOLD, 1, 0, STAYS),
        (POSCTL, 1, 0, STAYS),
        (HOLD, 3, 0, LANDS),
        (POSCTL, 2, 7, RETURNS),
        (HOLD, 0, 0, STAYS),
        (POSCTL, 0, 0, UNKNOWN),
        (HOLD, 5, 0, UNKNOWN),
    ],
)
def test_px4_without_a_receiver(mode: int, action: int, exceptions: int, expected: AfterSticks) -> None:
    values = {"NAV_RCL_ACT": float(action), "COM_RCL_EXCEPT": float(exceptions)}
    assert after_sticks(PX4, mode, values=values, has_radio=False) is expected
