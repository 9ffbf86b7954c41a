"""Who may fly: the lease of one drone as a pure transition table. No clock, no database, no socket.

Its laws:
- A drone has one holder or none. Every change of the holder makes the epoch grow by one.
- What is not in the table is a refusal with a code and words for people; there is no third outcome.
- A change names its orders; whoever applies it carries them out.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from wire.ids import Epoch, UserId


class Phase(StrEnum):
    """Read off a lease: nobody, somebody, or an admin who took it away from somebody."""

    FREE = "free"
    HELD = "held"
    TAKEN = "taken"


class Event(StrEnum):
    """What somebody asks for."""

    ACQUIRE = "acquire"
    RELEASE = "release"
    TAKE = "take"
    GIVE = "give"
    REVOKE = "revoke"


class Order(StrEnum):
    """What has to be done beside the change itself."""

    HOLD = "hold"
    HOLD_IF_FLOWN_BY_HAND = "hold-if-flown-by-hand"


NO_EPOCH: Final = Epoch(0)
"""Of a drone that nobody ever held."""


@dataclass(frozen=True)
class Actor:
    """Whoever asks, and what the decision depends on beside the lease itself.

    `holds_another`: an operator who has the controls of a different drone. `operator_may_fly`: the one it was taken
    from is still an owner with an account, and does not hold a different drone.
    """

    user_id: UserId
    is_admin: bool
    is_owner: bool
    holds_another: bool = False
    operator_may_fly: bool = True


@dataclass(frozen=True)
class Lease:
    """`taken_from` is set only while an admin holds what they took; that user is shut out until it is given back."""

    holder: UserId | None = None
    taken_from: UserId | None = None
    epoch: Epoch = NO_EPOCH

    @property
    def phase(self) -> Phase:
        if self.taken_from is not None:
            return Phase.TAKEN
        return Phase.FREE if self.holder is None else Phase.HELD


@dataclass(frozen=True)
class Changed:
    """The new lease, with what has to be done."""

    lease: Lease
    orders: tuple[Order, ...] = ()


@dataclass(frozen=True)
class Refused:
    """Why not. `code` is for programs, `words` for people."""

    code: str
    words: str


Outcome = Changed | Refused
Rule = Callable[[Lease, Actor], Outcome]


def _next(lease: Lease, *, holder: UserId | None, taken_from: UserId | None = None) -> Lease:
    return replace(lease, holder=holder, taken_from=taken_from, epoch=Epoch(lease.epoch + 1))


def _acquire_free(lease: Lease, actor: Actor) -> Outcome:
    if not (actor.is_owner or actor.is_admin):
        return Refused("not-an-owner", "only an owner of this drone can take its controls")
    if actor.holds_another:
        return Refused("holds-another", "release the drone that you are flying first")
    return Changed(_next(lease, holder=actor.user_id))


def _acquire_held(lease: Lease, actor: Actor) -> Outcome:
    if lease.holder == actor.user_id:
        return Refused("already-yours", "you already have the controls")
    return Refused("held-by-other", "somebody else has the controls")


def _acquire_taken(lease: Lease, actor: Actor) -> Outcome:
    if lease.taken_from == actor.user_id:
        return Refused("taken-away", "an admin has taken the controls; wait until they are given back")
    return _acquire_held(lease, actor)


def _release(lease: Lease, actor: Actor) -> Outcome:
    if lease.holder != actor.user_id:
        return Refused("not-the-holder", "only the holder can release the controls")
    return Changed(_next(lease, holder=None), (Order.HOLD_IF_FLOWN_BY_HAND,))


def _release_free(lease: Lease, actor: Actor) -> Outcome:
    return Refused("not-the-holder", "nobody has the controls")


def _take_free(lease: Lease, actor: Actor) -> Outcome:
    if not actor.is_admin:
        return Refused("admins-only", "only an admin can take the controls from somebody")
    # Nobody flies it, so nobody is shut out; but a drone that nobody holds may be in the air, so it holds first.
    return Changed(_next(lease, holder=actor.user_id), (Order.HOLD,))


def _take_held(lease: Lease, actor: Actor) -> Outcome:
    if not actor.is_admin:
        return Refused("admins-only", "only an admin can take the controls from somebody")
    if lease.holder == actor.user_id:
        return Refused("already-yours", "you already have the controls")
    return Changed(_next(lease, holder=actor.user_id, taken_from=lease.holder), (Order.HOLD,))


def _take_taken(lease: Lease, actor: Actor) -> Outcome:
    if not actor.is_admin:
        return Refused("admins-only", "only an admin can take the controls from somebody")
    if lease.holder == actor.user_id:
        return Refused("already-yours", "you already have the controls")
    # From one admin to another it is still owed to the operator it was taken from first, unless that is who takes it
    # now, having been made an admin meanwhile.
    owed_to = lease.taken_from if lease.taken_from != actor.user_id else None
    return Changed(_next(lease, holder=actor.user_id, taken_from=owed_to), (Order.HOLD,))


def _give_taken(lease: Lease, actor: Actor) -> Outcome:
    if lease.holder != actor.user_id or not actor.is_admin:
        return Refused("not-the-holder", "only the admin who took the controls can give them back")
    if not actor.operator_may_fly:
        return Refused("cannot-receive", "the operator cannot fly this drone now; release the controls instead")
    return Changed(_next(lease, holder=lease.taken_from), (Order.HOLD,))


def _give_nothing(lease: Lease, actor: Actor) -> Outcome:
    if not actor.is_admin:
        return Refused("admins-only", "only an admin who took the controls can give them back")
    return Refused("nothing-to-give", "the controls were not taken from anybody")


def _revoke(lease: Lease, actor: Actor) -> Outcome:
    return Changed(_next(lease, holder=None), (Order.HOLD,))


def _revoke_free(lease: Lease, actor: Actor) -> Outcome:
    return Refused("not-the-holder", "nobody has the controls")


TABLE: Final[dict[tuple[Phase, Event], Rule]] = {
    (Phase.FREE, Event.ACQUIRE): _acquire_free,
    (Phase.FREE, Event.RELEASE): _release_free,
    (Phase.FREE, Event.TAKE): _take_free,
    (Phase.FREE, Event.GIVE): _give_nothing,
    (Phase.FREE, Event.REVOKE): _revoke_free,
    (Phase.HELD, Event.ACQUIRE): _acquire_held,
    (Phase.HELD, Event.RELEASE): _release,
    (Phase.HELD, Event.TAKE): _take_held,
    (Phase.HELD, Event.GIVE): _give_nothing,
    (Phase.HELD, Event.REVOKE): _revoke,
    (Phase.TAKEN, Event.ACQUIRE): _acquire_taken,
    (Phase.TAKEN, Event.RELEASE): _release,
    (Phase.TAKEN, Event.TAKE): _take_taken,
    (Phase.TAKEN, Event.GIVE): _give_taken,
    (Phase.TAKEN, Event.REVOKE): _revoke,
}
"""Every cell is filled: a test walks the whole product of phases and events."""


def decide(lease: Lease, event: Event, actor: Actor) -> Outcome:
    """What becomes of `event`. Total: never raises."""
    return TABLE[lease.phase, event](lease, actor)
