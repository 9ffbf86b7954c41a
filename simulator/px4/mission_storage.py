"""How PX4 stores an item, and what it sends back.

Items with a position (frames 0, 3, 5 and 6) keep the parameters that PX4 knows; items of frame 2 keep seven floats.
Source: PX4 main of 2025, mavlink_mission.cpp and navigation.h. Not compared with a real PX4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from simulator.dialect import mavlink
from simulator.mission_plan import Item, PlanKind
from simulator.mission_storage import single

ABSOLUTE, RELATIVE, NO_PLACE = (0, 5), (3, 6), 2
ROI_AS_IT_WAS, JUMP, ROI = 80, 177, 201

Four = tuple[float, float, float, float]


def _heading(degrees: float) -> float:
    """Converts through radians, from 0 to 2 pi, in single precision."""
    if not math.isfinite(degrees):
        return degrees
    turn = single(math.tau)
    radians = single(degrees * single(math.pi / 180.0))
    radians = single(radians - turn * math.floor(radians / turn))
    return single(radians * single(180.0 / math.pi))


PLACED: dict[int, Callable[[float, float, float, float], Four]] = {
    16: lambda time, radius, _, heading: (time, radius, 0.0, _heading(heading)),
    17: lambda _, __, radius, heading: (0.0, 0.0, radius, _heading(heading)),
    19: lambda time, forced, radius, tangent: (time, float(forced > 0), radius, float(tangent > 0)),
    21: lambda _, precision, __, heading: (0.0, float(int(precision) & 0xFFFF), 0.0, _heading(heading)),
    22: lambda _, __, ___, heading: (0.0, 0.0, 0.0, _heading(heading)),
    31: lambda forced, radius, _, tangent: (float(forced > 0), radius, 0.0, float(tangent > 0)),
    84: lambda _, __, ___, heading: (0.0, 0.0, 0.0, _heading(heading)),
    85: lambda _, __, ___, heading: (0.0, 0.0, 0.0, _heading(heading)),
    **dict.fromkeys((ROI_AS_IT_WAS, 195, ROI, 4501), lambda _, __, ___, ____: (0.0, 0.0, 0.0, 0.0)),
}
"""The parameters of each command with a position, as they are sent back."""

UNPLACED = frozenset(
    {20, ROI_AS_IT_WAS, 93, 112, 114, JUMP, 178, 179, 187, 189, 196, 197, 200, ROI, 203, 204, 205, 206, 211, 212, 214}
    | {260, 400, 530, 532, 534, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 3000, 42600}
)
COMMANDS = UNPLACED | frozenset(PLACED)


def accept_item(item: Item, kind: PlanKind) -> Item | int:
    """Returns the item as it will be read back, or the MAV_MISSION_RESULT that refuses it."""
    if item.frame not in (*ABSOLUTE, *RELATIVE, NO_PLACE):
        return int(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    if any(map(math.isinf, item.params)) or not math.isfinite(item.z):  # PX4 would store it
        return int(mavlink.MAV_MISSION_INVALID)
    if kind is not PlanKind.MISSION:
        return _accept_do_command(item, kind)
    if item.frame == NO_PLACE:
        return _accept_unplaced(item)
    if item.command not in PLACED:
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    is_roi = item.command in (ROI_AS_IT_WAS, ROI)
    if is_roi and item.params[0] not in (0.0, 3.0):
        return int(mavlink.MAV_MISSION_INVALID_PARAM1)
    if item.command == 21 and math.isnan(item.params[1]):
        return int(mavlink.MAV_MISSION_INVALID_PARAM2)
    return replace(
        item,
        command=ROI if is_roi else item.command,
        frame=5 if item.frame in ABSOLUTE else 6,
        params=PLACED[item.command](*item.params),
        autocontinue=item.autocontinue & 1,
    )


def why_not_whole(items: Sequence[Item], kind: PlanKind) -> int | None:
    """PX4 refuses single items only."""
    del items, kind
    return None


def why_not_jump(item: Item, last: int) -> int | None:
    """PX4 checks jumps when the mission starts."""
    del item, last
    return None


def _accept_unplaced(item: Item) -> Item | int:
    if item.command not in UNPLACED:
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    command, params = item.command, item.params
    if command in (ROI_AS_IT_WAS, ROI):
        if math.isnan(params[0]) or int(params[0]) not in (0, 1, 2):
            return int(mavlink.MAV_MISSION_INVALID_PARAM1)
        command = ROI
    elif command == JUMP:
        target, times = (0 if math.isnan(value) else int(value) for value in params[:2])
        params = (float(target & 0x7FFF), float(times & 0xFFFF), *params[2:])
    x, y = (int(single(float(value))) for value in (item.x, item.y))
    return replace(item, command=command, params=params, x=x, y=y, autocontinue=item.autocontinue & 1)


def _accept_do_command(item: Item, kind: PlanKind) -> Item | int:
    if item.frame == NO_PLACE or item.command not in (range(5000, 5005) if kind is PlanKind.FENCE else (5100,)):
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    first = item.number(0)
    if kind is PlanKind.RALLY:
        frame = 5 if item.frame in ABSOLUTE else 6
        return replace(item, frame=frame, params=(0.0,) * 4, autocontinue=item.autocontinue & 1)
    if item.command in (5001, 5002):
        first = float(int(single(first + 0.5)) & 0xFFFF)
        if first < 3:
            return int(mavlink.MAV_MISSION_ERROR)
    elif item.command == 5000:
        first = 0.0
    return replace(item, frame=5, params=(first, 0.0, 0.0, 0.0), autocontinue=0)
