"""How many items of each kind an autopilot has room for: one table for agent, tower and console. Pure.

No autopilot reports its room in advance; it depends on the board's storage, and the autopilot refuses a larger plan as
a whole. These are the numbers of the usual boards, so exceeding them is a warning and not an error. The console has
them in web/src/plan/plan_room.ts; tests/unit/wire/golden/plan_room.json checks both against the same numbers.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from wire.plans import MAX_ITEMS_ANY, PlanKind

Room = Mapping[PlanKind, int]


def _room(mission: int, fence: int, rally: int) -> Room:
    return MappingProxyType({PlanKind.MISSION: mission, PlanKind.FENCE: fence, PlanKind.RALLY: rally})


ARDUPILOT_ROOM: Final = _room(649, 70, 46)
"""Copter with 16 KiB of storage. Source: StorageManager's layout (4.7-dev of July 2025): 9,758 bytes for the mission at
15 an item are 650, including home; 560 at 8 for the fence, 690 at 15 for rally points. Tested on its own simulator
(tests/real). Boards of 15 KiB take 302 mission items, those of 32 KiB 1,305; with an SD card more."""

PX4_ROOM: Final = _room(MAX_ITEMS_ANY, 64, 32)
"""Source: dataman (1.16): 2,000 mission items, more than a plan here has; boards with little flash take fewer."""

MAX_ROOM: Final = _room(MAX_ITEMS_ANY, MAX_ITEMS_ANY, MAX_ITEMS_ANY)
"""For an unknown autopilot."""
