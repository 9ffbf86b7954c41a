"""How many items of each kind an autopilot has room for. Pure.

No autopilot reports its room in advance; it depends on the board's storage, and the autopilot refuses a larger plan as
a whole. These are the numbers of the usual boards, so exceeding them is a warning and not an error. They
stand beside the tables of what each autopilot keeps (`wire/autopilots/*_plans.py`).
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from wire.plans import MAX_ITEMS_ANY, PlanKind

Room = Mapping[PlanKind, int]


def room(mission: int, fence: int, rally: int) -> Room:
    return MappingProxyType({PlanKind.MISSION: mission, PlanKind.FENCE: fence, PlanKind.RALLY: rally})


MAX_ROOM: Final = room(MAX_ITEMS_ANY, MAX_ITEMS_ANY, MAX_ITEMS_ANY)
"""For an unknown autopilot."""
