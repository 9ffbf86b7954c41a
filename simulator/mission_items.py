"""One mission, fence or rally item: read from a message, and judged as the autopilot judges it."""

from __future__ import annotations

import math

from simulator.dialect import Message, mavlink
from simulator.mission_plan import Item, PlanKind

FRAMES = frozenset({0, 2, 3, 5, 6, 10, 11})
COMMANDS = frozenset(
    {16, 17, 18, 19, 20, 21, 22, 82, 93, 112, 114, 115, 177, 178, 179, 181, 183, 184, 189, 195, 197, 201, 203, 205}
    | {206, 207, 211, 212, 222, 2000, 2001, 2500, 2501}
)
FENCE_COMMANDS = frozenset(range(5000, 5005))
RALLY_COMMANDS = frozenset({5100})
KNOWN_COMMANDS = {
    PlanKind.MISSION: COMMANDS,
    PlanKind.FENCE: FENCE_COMMANDS,
    PlanKind.RALLY: RALLY_COMMANDS,
}


def read_item(message: Message, *, keep_nan: bool) -> Item:
    """An item as it is stored, from either message. An old one without whole numbers has a place of 2^31 - 1 where its
    own is none, which `why_not` refuses."""
    if message.get_type() == "MISSION_ITEM":
        x, y = (round(v * 1e7) if math.isfinite(v) and abs(v) < 200 else 2**31 - 1 for v in (message.x, message.y))
    else:
        x, y = message.x, message.y
    raw = (message.param1, message.param2, message.param3, message.param4)
    params = tuple(0.0 if math.isnan(value) and not keep_nan else value for value in raw)
    return Item(
        message.command,
        message.frame,
        (params[0], params[1], params[2], params[3]),
        x,
        y,
        message.z,
        message.autocontinue,
    )


def why_not(item: Item, kind: PlanKind) -> int | None:
    """The MAV_MISSION_RESULT with which an item is refused, or None."""
    if item.command not in KNOWN_COMMANDS[kind]:
        return int(mavlink.MAV_MISSION_UNSUPPORTED)
    if item.frame not in FRAMES:
        return int(mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    for number, value in enumerate(item.params):
        if math.isinf(value):
            return int(mavlink.MAV_MISSION_INVALID_PARAM1) + number
    if abs(item.x) > 900_000_000:
        return int(mavlink.MAV_MISSION_INVALID_PARAM5_X)
    if abs(item.y) > 1_800_000_000:
        return int(mavlink.MAV_MISSION_INVALID_PARAM6_Y)
    if not math.isfinite(item.z) or abs(item.z) > 50_000:
        return int(mavlink.MAV_MISSION_INVALID_PARAM7)
    return None
