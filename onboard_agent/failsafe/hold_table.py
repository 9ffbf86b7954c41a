"""The phases of a hold and their transitions: the table that `hold.py` runs and the documentation draws."""

from enum import StrEnum
from typing import Final

from wire.control_messages import HoldStep


class HoldPhase(StrEnum):
    """Progress of stage one. Sticks and stage two have their own states, and may end before or after it."""

    IDLE = "idle"
    WATCHING = "watching"
    """The drone is reported disarmed. A heartbeat must prove it; if the drone arms, it is held."""
    REQUESTING = "requesting"
    """No mode of the ladder has been accepted."""
    ACKNOWLEDGED = "acknowledged"
    """A mode has been accepted, but the heartbeat does not show it yet."""
    CONFIRMED = "confirmed"
    UNCONFIRMED = "unconfirmed"
    HANDING = "handing over"
    """The pilot's sticks arrived in a mode that does not use them; a mode that does is requested."""


class HoldEvent(StrEnum):
    """What can happen to a hold."""

    ARMED = "armed"
    """A heartbeat younger than the order shows it, or none arrived in time to disprove it."""
    ACCEPTED = "accepted"
    """A COMMAND_ACK accepts a rung that was not accepted before."""
    MODE_SHOWN = "mode shown"
    """A heartbeat after the order shows an accepted rung, armed."""
    DEADLINE_PASSED = "deadline passed"
    DISARMED = "disarmed"
    """A heartbeat younger than the order shows it."""
    WATCHED = "watched"
    """The order has been open for long enough."""
    OVERRULED = "overruled"
    """Another command controls the flight, or the lost action is done."""


_P = HoldPhase
_E = HoldEvent

NEXT: Final[dict[tuple[HoldPhase, HoldEvent], tuple[HoldPhase, HoldStep | None]]] = {
    (_P.WATCHING, _E.ARMED): (_P.REQUESTING, None),
    (_P.WATCHING, _E.WATCHED): (_P.IDLE, None),
    (_P.WATCHING, _E.OVERRULED): (_P.IDLE, None),
    (_P.REQUESTING, _E.ACCEPTED): (_P.ACKNOWLEDGED, HoldStep.MODE_ACKNOWLEDGED),
    (_P.REQUESTING, _E.DEADLINE_PASSED): (_P.UNCONFIRMED, HoldStep.UNCONFIRMED),
    (_P.REQUESTING, _E.DISARMED): (_P.WATCHING, HoldStep.NOT_NEEDED),
    (_P.REQUESTING, _E.OVERRULED): (_P.IDLE, HoldStep.UNCONFIRMED),
    (_P.ACKNOWLEDGED, _E.ACCEPTED): (_P.ACKNOWLEDGED, HoldStep.MODE_ACKNOWLEDGED),  # the next rung
    (_P.ACKNOWLEDGED, _E.MODE_SHOWN): (_P.CONFIRMED, HoldStep.CONFIRMED),
    (_P.ACKNOWLEDGED, _E.DEADLINE_PASSED): (_P.ACKNOWLEDGED, HoldStep.UNCONFIRMED),
    (_P.ACKNOWLEDGED, _E.DISARMED): (_P.WATCHING, HoldStep.NOT_NEEDED),
    (_P.ACKNOWLEDGED, _E.OVERRULED): (_P.IDLE, HoldStep.UNCONFIRMED),
    (_P.UNCONFIRMED, _E.ACCEPTED): (_P.ACKNOWLEDGED, HoldStep.MODE_ACKNOWLEDGED),
    (_P.UNCONFIRMED, _E.DISARMED): (_P.WATCHING, HoldStep.NOT_NEEDED),
    (_P.UNCONFIRMED, _E.OVERRULED): (_P.IDLE, None),
    (_P.CONFIRMED, _E.DISARMED): (_P.WATCHING, None),
    (_P.CONFIRMED, _E.OVERRULED): (_P.IDLE, None),
    (_P.HANDING, _E.MODE_SHOWN): (_P.IDLE, None),
    (_P.HANDING, _E.DISARMED): (_P.IDLE, None),
    (_P.HANDING, _E.OVERRULED): (_P.IDLE, None),
}
"""Missing pairs are ignored, such as a late acknowledgement or a heartbeat before the acknowledgement."""

OPEN: Final = frozenset({_P.REQUESTING, _P.ACKNOWLEDGED, _P.CONFIRMED, _P.UNCONFIRMED})
"""The drone holds, or a hold is in progress."""

WANTS_MODE: Final = frozenset({_P.REQUESTING, _P.ACKNOWLEDGED, _P.UNCONFIRMED, _P.HANDING})
