"""A flight to a target ends where a hold is asked for, also on an autopilot that flies on in the hold's mode."""

import math
from typing import Any

import pytest

from onboard_agent.autopilot.own_frames import FrameMaker, command_long, set_mode
from onboard_agent.autopilot.stop_behind_hold import StopBehindHold
from wire.dialect import build, decode, mavlink

PX4, ARDUPILOT = mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
LOITER, RTL = (4.0, 3.0), (4.0, 5.0)


def frame(message: Any) -> bytes:
    return build(message, system_id=255, component_id=190, sequence=0)


def sent(*messages: Any, kind: int = PX4, system_id: int | None = 1, airborne: bool = True) -> list[Any]:
    """What goes to the autopilot beside these."""
    stops = StopBehindHold(FrameMaker())
    stops.is_due = airborne
    given = [frame(one) for one in messages]
    found = stops.add(given, autopilot_kind=kind, vehicle_system_id=system_id)
    assert [one for one in found if one in given] == given
    return [decode(one) for one in found if one not in given]


ASKS = (
    set_mode(1, LOITER, confirmation=0),
    mavlink.MAVLink_command_int_message(1, 1, 0, 176, 0, 0, 1.0, *LOITER, 0.0, 0, 0, 0.0),
    mavlink.MAVLink_set_mode_message(1, 1, 4 << 16 | 3 << 24),
)


@pytest.mark.parametrize("ask", ASKS, ids=["long", "int", "old"])
def test_a_stop_follows_the_hold(ask: Any) -> None:
    (stop,) = sent(ask)
    assert (stop.command, stop.param1, stop.param2) == (mavlink.MAV_CMD_DO_REPOSITION, -1.0, 1.0)
    assert all(math.isnan(one) for one in (stop.param4, stop.param5, stop.param6, stop.param7))


@pytest.mark.parametrize(
    "other",
    [
        set_mode(1, RTL, confirmation=0),
        command_long(1, mavlink.MAV_CMD_DO_REPOSITION, -1, 1),
        command_long(1, mavlink.MAV_CMD_DO_SET_MODE, math.nan, *LOITER),
        command_long(1, mavlink.MAV_CMD_DO_SET_MODE, 1, math.inf, 3),
        mavlink.MAVLink_set_mode_message(1, 0, 4 << 16 | 3 << 24),
        mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0),
    ],
)
def test_nothing_follows_anything_else(other: Any) -> None:
    assert sent(other) == []


def test_nothing_follows_on_the_ground_or_for_an_autopilot_that_stops() -> None:
    assert sent(ASKS[0], airborne=False) == sent(ASKS[0], kind=ARDUPILOT) == sent(ASKS[0], system_id=None) == []
