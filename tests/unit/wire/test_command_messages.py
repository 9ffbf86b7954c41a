"""The same command as COMMAND_LONG and as COMMAND_INT: every value and height keeps its meaning, or it is not sent."""

from math import isnan, nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.autopilots.command_messages import PLACED, UNKNOWN_PLACE, message_of
from wire.autopilots.command_messages import as_the_other as _as_the_other
from wire.dialect import mavlink
from wire.transactions import CommandWork

ARDUPILOT, PX4, OTHER = 3, 12, 0
M = mavlink
NEAR_M = 1.0
"""A COMMAND_LONG has 32 bits for a longitude."""


def as_the_other(message: Any, kind: int, confirmation: int = 0) -> Any:
    return _as_the_other(message, kind, confirmation)


def long(command: int, *params: float) -> Any:
    return M.MAVLink_command_long_message(1, 1, command, 2, *[*params, *[0.0] * 7][:7])


def at(command: int, frame: int, height_m: float, x: int = 473977420, y: int = 85455940) -> Any:
    return M.MAVLink_command_int_message(1, 1, frame, command, 0, 0, 1.0, 2.0, 3.0, nan, x, y, height_m)


@given(st.integers(-1000, 1000), st.integers(-1000, 1000), st.floats(-1e6, 1e6, width=32))
def test_what_has_no_place_is_the_same_there_and_back(fifth: int, sixth: int, last: float) -> None:
    first = long(M.MAV_CMD_DO_SET_SERVO, 1, 2, 3, 4, fifth, sixth, last)
    other = as_the_other(first, OTHER)
    assert (other.get_type(), other.x, other.y, other.z) == ("COMMAND_INT", fifth, sixth, last)
    back = as_the_other(other, OTHER, confirmation=3)
    assert (back.param1, back.param4, back.param5, back.param6, back.param7) == (1, 4, fifth, sixth, last)
    assert back.confirmation == 3


def test_a_fraction_that_no_whole_number_can_carry_is_not_rounded() -> None:
    assert as_the_other(long(M.MAV_CMD_DO_SET_SERVO, 1, 2, 3, 4, 0.5), ARDUPILOT) is None


@pytest.mark.parametrize("value", [float("inf"), 3e9, -3e9])
def test_a_number_beyond_32_bits_is_not_cut(value: float) -> None:
    assert as_the_other(long(M.MAV_CMD_DO_SET_SERVO, 1, 2, 3, 4, 0, value), ARDUPILOT) is None


def test_take_off_climbs_as_high_in_either_message() -> None:
    """ArduPilot's heights are above home, PX4's above the sea."""
    for kind, frames in ((ARDUPILOT, (3, 6)), (PX4, (0, 5))):
        other = as_the_other(long(M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, nan, nan, nan, 30), kind)
        assert (other.x, other.y, other.z) == (UNKNOWN_PLACE, UNKNOWN_PLACE, 30)
        assert other.frame in frames


def test_a_place_goes_to_the_other_message_where_its_height_keeps_its_meaning() -> None:
    other = as_the_other(at(M.MAV_CMD_DO_REPOSITION, 0, 518.0), PX4)
    assert other.get_type() == "COMMAND_LONG" and other.param7 == 518.0
    assert abs(other.param5 - 47.397742) * 111_320 < NEAR_M
    home = as_the_other(at(M.MAV_CMD_DO_SET_HOME, 0, 488.0), ARDUPILOT)
    assert home.param7 == 488.0


@pytest.mark.parametrize(
    ("message", "kind"),
    [
        (at(M.MAV_CMD_DO_REPOSITION, 6, 30.0), PX4),
        (at(M.MAV_CMD_DO_REPOSITION, 3, 30.0), PX4),
        (at(M.MAV_CMD_DO_REPOSITION, 6, 30.0), ARDUPILOT),
        (at(M.MAV_CMD_DO_REPOSITION, 11, 30.0), ARDUPILOT),
        (at(M.MAV_CMD_DO_SET_HOME, 6, 30.0), ARDUPILOT),
        (at(M.MAV_CMD_DO_SET_ROI_LOCATION, 0, 30.0), OTHER),
        (long(M.MAV_CMD_DO_REPOSITION, 0, 0, 0, 0, 47.0, 8.0, 30.0), ARDUPILOT),
        (long(M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 30.0), OTHER),
        (long(M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 400.0, 0, 30.0), ARDUPILOT),
    ],
)
def test_a_height_that_might_be_read_differently_stays_where_it_is(message: Any, kind: int) -> None:
    assert as_the_other(message, kind) is None


def test_a_place_without_a_height_has_no_frame_to_lose() -> None:
    other = as_the_other(at(M.MAV_CMD_DO_ORBIT, 6, nan, x=UNKNOWN_PLACE, y=UNKNOWN_PLACE), OTHER)
    assert isnan(other.param5) and isnan(other.param6) and isnan(other.param7)


def test_every_command_of_the_dialect_with_a_place_that_an_operation_sends_is_known() -> None:
    sent = (M.MAV_CMD_DO_REPOSITION, M.MAV_CMD_DO_SET_HOME, M.MAV_CMD_DO_ORBIT, M.MAV_CMD_DO_SET_ROI_LOCATION)
    assert PLACED.issuperset(sent)
    assert all(M.enums["MAV_CMD"][one].has_location or one == M.MAV_CMD_OVERRIDE_GOTO for one in PLACED)


def test_the_component_is_kept() -> None:
    work = CommandWork(M.MAV_CMD_SET_CAMERA_ZOOM, (2.0, 50.0, 0.0, 0.0, 0.0, 0.0, 0.0), component=100)
    message = message_of(work, 1, 0)
    assert (message.target_component, as_the_other(message, OTHER).target_component) == (100, 100)
