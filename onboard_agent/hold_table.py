"""The phases of a hold and what leads from one to the next: the table that `hold.py` runs and the documents draw."""

from enum import StrEnum
from typing import Final

from wire.control_messages import HoldStep


class HoldPhase(StrEnum):
    """How far the change of mode is. The sticks have their own switch: they may outlast it or end before it."""

    IDLE = "idle"
    REQUESTING = "requesting"
    """No mode of the ladder has been accepted."""
    ACKNOWLEDGED = "acknowledged"
    """One has, but the heartbeat does not show it yet."""
    CONFIRMED = "confirmed"
    UNCONFIRMED = "unconfirmed"


class HoldEvent(StrEnum):
    """What can happen to a hold."""

    ACCEPTED = "accepted"
    """COMMAND_ACK says so, of a rung that was not accepted before."""
    MODE_SHOWN = "mode shown"
    """A heartbeat after the order shows an accepted rung, armed."""
    DEADLINE_PASSED = "deadline passed"
    BOUND_PASSED = "bound passed"
    DISARMED = "disarmed"
    OVERRULED = "overruled"
    """The holder has commanded how to fly, or the tower stays lost and something else is done."""


_P = HoldPhase
_E = HoldEvent

NEXT: Final[dict[tuple[HoldPhase, HoldEvent], tuple[HoldPhase, HoldStep | None]]] = {
    (_P.REQUESTING, _E.ACCEPTED): (_P.ACKNOWLEDGED, HoldStep.MODE_ACKNOWLEDGED),
    (_P.REQUESTING, _E.DEADLINE_PASSED): (_P.UNCONFIRMED, HoldStep.UNCONFIRMED),
    (_P.REQUESTING, _E.BOUND_PASSED): (_P.IDLE, HoldStep.UNCONFIRMED),  # the process was stopped in between
    (_P.REQUESTING, _E.DISARMED): (_P.IDLE, HoldStep.NOT_NEEDED),
    (_P.REQUESTING, _E.OVERRULED): (_P.IDLE, HoldStep.UNCONFIRMED),
    (_P.ACKNOWLEDGED, _E.ACCEPTED): (_P.ACKNOWLEDGED, HoldStep.MODE_ACKNOWLEDGED),  # the next rung
    (_P.ACKNOWLEDGED, _E.MODE_SHOWN): (_P.CONFIRMED, HoldStep.CONFIRMED),
    (_P.ACKNOWLEDGED, _E.DEADLINE_PASSED): (_P.ACKNOWLEDGED, HoldStep.UNCONFIRMED),
    (_P.ACKNOWLEDGED, _E.BOUND_PASSED): (_P.IDLE, None),
    (_P.ACKNOWLEDGED, _E.DISARMED): (_P.IDLE, HoldStep.NOT_NEEDED),
    (_P.ACKNOWLEDGED, _E.OVERRULED): (_P.IDLE, HoldStep.UNCONFIRMED),
    (_P.UNCONFIRMED, _E.ACCEPTED): (_P.ACKNOWLEDGED, HoldStep.MODE_ACKNOWLEDGED),
    (_P.UNCONFIRMED, _E.BOUND_PASSED): (_P.IDLE, None),
    (_P.UNCONFIRMED, _E.DISARMED): (_P.IDLE, None),
    (_P.UNCONFIRMED, _E.OVERRULED): (_P.IDLE, None),
    (_P.CONFIRMED, _E.BOUND_PASSED): (_P.IDLE, None),
    (_P.CONFIRMED, _E.DISARMED): (_P.IDLE, None),
    (_P.CONFIRMED, _E.OVERRULED): (_P.IDLE, None),
}
"""A pair that is missing means nothing: a late acknowledgement, a heartbeat before the acknowledgement."""
