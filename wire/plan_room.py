"""How many items of each kind an autopilot has room for: one table for agent, tower and console. Pure.

No autopilot tells its room beforehand; it depends on the board's storage and refuses the whole of what is more. These
are the numbers of the usual boards, so more is a warning and not an error. The console has them in
web/src/plan/plan_room.ts; tests/unit/wire/golden/plan_room.json holds both to the same.
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
15 an item make 650, one of them home; 560 at 8 for the fence, 690 at 15 for rally points. Tested with its own simulator
(tests/real). Boards with 15 KiB have room for 302 mission items, those with 32 KiB for 1,305; with a card more."""

PX4_ROOM: Final = _room(MAX_ITEMS_ANY, 64, 32)
"""Source: dataman (1.16): 2,000 items of a mission, more than a plan here has; boards of little flash take fewer."""

MAX_ROOM: Final = _room(MAX_ITEMS_ANY, MAX_ITEMS_ANY, MAX_ITEMS_ANY)
"""For an unknown autopilot."""
