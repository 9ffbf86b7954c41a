"""What an autopilot keeps of a plan if nothing is known of it: every bit must come back. Pure."""

from wire.plan_fields import ItemKept, fields_of, same_or_open
from wire.plan_room import MAX_ROOM
from wire.plans import PlanItem, PlanKind


class Verbatim:
    """The KeptFields of an unknown autopilot: every bit must come back."""

    name = "The autopilot"
    room = MAX_ROOM
    lacks: frozenset[int] = frozenset()

    def to_send(self, kind: PlanKind, item: PlanItem) -> PlanItem:
        """Returns the item unchanged."""
        del kind
        return item

    def kept(self, kind: PlanKind, item: PlanItem) -> ItemKept:
        """The item as it was sent."""
        del kind
        return ItemKept({name: same_or_open(value) for name, value in fields_of(item).items()})
