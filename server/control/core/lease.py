"""Who may fly: the lease of one drone as a pure transition table. No clock, no database, no socket.

Invariants:
- A drone has one holder or none. Every change of a lease increments the epoch by one.
- An event that is not allowed is refused with a code and a text for people; there is no third outcome.
- A change lists its orders; the caller carries them out.
- The rules are in `lease_rules.py`; this table assigns a rule to each event in each phase.
"""

from typing import Final

from server.control.core import lease_rules as rules
from server.control.core.lease_types import (
    NO_EPOCH,
    TOWER,
    Actor,
    Changed,
    Event,
    Lease,
    Order,
    Outcome,
    Phase,
    Refused,
    Rule,
)

__all__ = [
    "NO_EPOCH",
    "TABLE",
    "TOWER",
    "Actor",
    "Changed",
    "Event",
    "Lease",
    "Order",
    "Outcome",
    "Phase",
    "Refused",
    "decide",
]

TABLE: Final[dict[tuple[Phase, Event], Rule]] = {
    (Phase.FREE, Event.ACQUIRE): rules.acquire_free,
    (Phase.FREE, Event.RELEASE): rules.nobody_holds,
    (Phase.FREE, Event.TAKE): rules.take_free,
    (Phase.FREE, Event.GIVE): rules.nothing_to_give,
    (Phase.FREE, Event.ACCEPT): rules.nothing_offered,
    (Phase.FREE, Event.ASSIST): rules.nobody_to_assist,
    (Phase.FREE, Event.ASSIST_END): rules.nobody_assists,
    (Phase.FREE, Event.TURN): rules.nobody_assists,
    (Phase.FREE, Event.REVOKE): rules.nobody_holds,
    (Phase.FREE, Event.FORGET): rules.nothing_taken,
    (Phase.FREE, Event.OFFER_LAPSED): rules.nothing_offered,
    (Phase.FREE, Event.EXPIRE): rules.nobody_holds,
    (Phase.HELD, Event.ACQUIRE): rules.acquire_held,
    (Phase.HELD, Event.RELEASE): rules.release,
    (Phase.HELD, Event.TAKE): rules.take_held,
    (Phase.HELD, Event.GIVE): rules.nothing_to_give,
    (Phase.HELD, Event.ACCEPT): rules.nothing_offered,
    (Phase.HELD, Event.ASSIST): rules.assist,
    (Phase.HELD, Event.ASSIST_END): rules.assist_end,
    (Phase.HELD, Event.TURN): rules.turn,
    (Phase.HELD, Event.REVOKE): rules.revoke,
    (Phase.HELD, Event.FORGET): rules.nothing_taken,
    (Phase.HELD, Event.OFFER_LAPSED): rules.nothing_offered,
    (Phase.HELD, Event.EXPIRE): rules.expire,
    (Phase.TAKEN, Event.ACQUIRE): rules.acquire_taken,
    (Phase.TAKEN, Event.RELEASE): rules.release,
    (Phase.TAKEN, Event.TAKE): rules.take_taken,
    (Phase.TAKEN, Event.GIVE): rules.give,
    (Phase.TAKEN, Event.ACCEPT): rules.nothing_offered,
    (Phase.TAKEN, Event.ASSIST): rules.admin_holds,
    (Phase.TAKEN, Event.ASSIST_END): rules.nobody_assists,
    (Phase.TAKEN, Event.TURN): rules.nobody_assists,
    (Phase.TAKEN, Event.REVOKE): rules.revoke,
    (Phase.TAKEN, Event.FORGET): rules.forget,
    (Phase.TAKEN, Event.OFFER_LAPSED): rules.nothing_offered,
    (Phase.TAKEN, Event.EXPIRE): rules.expire,
    (Phase.OFFERED, Event.ACQUIRE): rules.acquire_offered,
    (Phase.OFFERED, Event.RELEASE): rules.release,
    (Phase.OFFERED, Event.TAKE): rules.take_offered,
    (Phase.OFFERED, Event.GIVE): rules.already_offered,
    (Phase.OFFERED, Event.ACCEPT): rules.accept,
    (Phase.OFFERED, Event.ASSIST): rules.admin_holds,
    (Phase.OFFERED, Event.ASSIST_END): rules.nobody_assists,
    (Phase.OFFERED, Event.TURN): rules.nobody_assists,
    (Phase.OFFERED, Event.REVOKE): rules.revoke,
    (Phase.OFFERED, Event.FORGET): rules.forget,
    (Phase.OFFERED, Event.OFFER_LAPSED): rules.offer_lapsed,
    (Phase.OFFERED, Event.EXPIRE): rules.expire,
}
"""Every cell is filled: a test checks all combinations of phase and event."""


def decide(lease: Lease, event: Event, actor: Actor) -> Outcome:
    """Returns the outcome of `event`. Total: never raises."""
    return TABLE[lease.phase, event](lease, actor)
