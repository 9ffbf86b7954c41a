"""A command as the message that carries it, COMMAND_LONG or COMMAND_INT, and the same command as the other one. Pure.

An autopilot may take a command in one of the two only: it answers COMMAND_LONG_ONLY, COMMAND_INT_ONLY, or, as older
ones do, UNSUPPORTED.
"""

from collections.abc import Callable
from math import isfinite, isnan
from typing import Any, Final

from wire.dialect import mavlink
from wire.transactions import CommandWork

AUTOPILOT: Final = 1
UNKNOWN_PLACE: Final = 0x7FFFFFFF
"""NaN in the x and y of a COMMAND_INT."""

_M: Final = mavlink
_NAN: Final = float("nan")
_ABOVE_SEA: Final = frozenset({int(_M.MAV_FRAME_GLOBAL), int(_M.MAV_FRAME_GLOBAL_INT)})
_ABOVE_HOME: Final = frozenset({int(_M.MAV_FRAME_GLOBAL_RELATIVE_ALT), int(_M.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)})

PLACED: Final = frozenset(
    {
        int(_M.MAV_CMD_NAV_TAKEOFF),
        int(_M.MAV_CMD_NAV_VTOL_TAKEOFF),
        int(_M.MAV_CMD_NAV_LAND),
        int(_M.MAV_CMD_NAV_VTOL_LAND),
        int(_M.MAV_CMD_NAV_LOITER_UNLIM),
        int(_M.MAV_CMD_DO_SET_HOME),
        int(_M.MAV_CMD_DO_REPOSITION),
        int(_M.MAV_CMD_DO_ORBIT),
        int(_M.MAV_CMD_DO_FIGURE_EIGHT),
        int(_M.MAV_CMD_DO_SET_ROI),
        int(_M.MAV_CMD_DO_SET_ROI_LOCATION),
        int(_M.MAV_CMD_DO_LAND_START),
        int(_M.MAV_CMD_OVERRIDE_GOTO),
    }
)
"""Commands whose fifth and sixth parameter are latitude and longitude."""

_ARDUPILOT_HEIGHTS: Final = {
    int(_M.MAV_CMD_NAV_TAKEOFF): _ABOVE_HOME,
    int(_M.MAV_CMD_NAV_VTOL_TAKEOFF): _ABOVE_HOME,
    int(_M.MAV_CMD_DO_SET_HOME): _ABOVE_SEA,
}


def message_of(work: CommandWork, system_id: int, confirmation: int) -> Any:
    """Returns the message in which the tower wants the command sent. `confirmation`: how often it was sent before."""
    params = [_NAN if value is None else value for value in work.params]
    if work.x is None and work.y is None and work.frame is None:
        return _M.MAVLink_command_long_message(system_id, work.component, work.command, confirmation & 0xFF, *params)
    frame = _M.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT if work.frame is None else work.frame
    x, y = work.x or 0, work.y or 0
    return _M.MAVLink_command_int_message(
        system_id, work.component, frame, work.command, 0, 0, *params[:4], x, y, params[6]
    )


Make = Callable[[int], bytes]
"""Builds a frame with this confirmation number, 0..255."""


def makers(work: CommandWork, system_id: int, kind: int, pack: Callable[[Any], bytes]) -> tuple[Make, Make | None]:
    """Returns what builds the command's frame, and the frame of the same command as the other message, if there is
    one. `kind`: MAV_AUTOPILOT."""

    def make(confirmation: int) -> bytes:
        return pack(message_of(work, system_id, confirmation))

    def make_other(confirmation: int) -> bytes:
        return pack(as_the_other(message_of(work, system_id, 0), kind, confirmation))

    has_other = as_the_other(message_of(work, system_id, 0), kind) is not None
    return make, make_other if has_other else None


def as_the_other(message: Any, autopilot_kind: int, confirmation: int = 0) -> Any | None:
    """Returns the same command as the other message; None if that cannot say the same.

    A COMMAND_LONG names no frame, and autopilots differ in the one they suppose: PX4 reads every height above the sea.
    So a place with a height changes its message only where the height keeps its meaning.
    """
    if message.get_type() == "COMMAND_LONG":
        return _as_int(message, autopilot_kind)
    return _as_long(message, autopilot_kind, confirmation & 0xFF)


def _as_int(message: Any, kind: int) -> Any | None:
    first = (message.param1, message.param2, message.param3, message.param4)
    frame = int(_M.MAV_FRAME_GLOBAL)
    if message.command in PLACED:
        heights = _heights(message.command, kind)
        if heights is None:
            return None
        frame = min(heights)
        x, y = _e7(message.param5), _e7(message.param6)
    else:
        x, y = _whole(message.param5), _whole(message.param6)
    if x is None or y is None:
        return None
    return _M.MAVLink_command_int_message(
        message.target_system, message.target_component, frame, message.command, 0, 0, *first, x, y, message.param7
    )


def _as_long(message: Any, kind: int, confirmation: int) -> Any | None:
    last = [float(message.x), float(message.y)]
    if message.command in PLACED:
        heights = _heights(message.command, kind)
        if not isnan(message.z) and (heights is None or message.frame not in heights):
            return None
        last = [_NAN if value == UNKNOWN_PLACE else value / 1e7 for value in last]
    first = (message.param1, message.param2, message.param3, message.param4)
    return _M.MAVLink_command_long_message(
        message.target_system, message.target_component, message.command, confirmation, *first, *last, message.z
    )


def _heights(command: int, kind: int) -> frozenset[int] | None:
    """Returns the frames of the heights that this autopilot reads from a COMMAND_LONG; None: not known."""
    if kind == _M.MAV_AUTOPILOT_PX4:
        return _ABOVE_SEA
    return _ARDUPILOT_HEIGHTS.get(command) if kind == _M.MAV_AUTOPILOT_ARDUPILOTMEGA else None


def _e7(degrees: float) -> int | None:
    if not isfinite(degrees):
        return UNKNOWN_PLACE
    return round(degrees * 1e7) if abs(degrees) <= 180.0 else None


def _whole(value: float) -> int | None:
    if isnan(value):
        return UNKNOWN_PLACE
    return int(value) if isfinite(value) and value == int(value) and abs(value) < UNKNOWN_PLACE else None
