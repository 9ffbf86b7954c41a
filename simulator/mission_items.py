"""Reads a mission, fence or rally item from a message. How it is stored depends on the flavour (`mission_storage`)."""

from __future__ import annotations

import math

from simulator.dialect import Message
from simulator.mission_plan import Item


def read_item(message: Message) -> Item:
    """Reads either message. An item of the old message with an invalid position gets 2^31 - 1 for it."""
    if message.get_type() == "MISSION_ITEM":
        x, y = (round(v * 1e7) if math.isfinite(v) and abs(v) < 200 else 2**31 - 1 for v in (message.x, message.y))
    else:
        x, y = message.x, message.y
    params = (message.param1, message.param2, message.param3, message.param4)
    return Item(message.command, message.frame, params, x, y, message.z, message.autocontinue)
