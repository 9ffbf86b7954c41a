"""The types of the lease table: phases, events, orders, the lease itself, and the actor. No rules here."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from wire.ids import Epoch, UserId


class Phase(StrEnum):
    """Read off a lease."""

    FREE = "free"
    """Nobody has the controls."""
    HELD = "held"
    """Somebody has them, perhaps with an admin who assists."""
    TAKEN = "taken"
    """An admin has the controls and has shut out the operator."""
    OFFERED = "offered"
    """The same, and the controls are offered back; the operator has not accepted yet."""


class Event(StrEnum):
    """A request, or something that happened."""

    ACQUIRE = "acquire"
    RELEASE = "release"
    TAKE = "take"
    GIVE = "give"
    ACCEPT = "accept"
    ASSIST = "assist"
    ASSIST_END = "assist-end"
    TURN = "turn"
    """The frames of the other one of holder and assistant pass from now on."""
    REVOKE = "revoke"
    FORGET = "forget"
    """Whoever the controls were taken from has no right to them any more."""
    OFFER_LAPSED = "offer-lapsed"
    EXPIRE = "expire"
    """The holder's browsers have been gone for the whole grace time."""


class Order(StrEnum):
    """What has to be done beside the change itself."""

    HOLD = "hold"
    HOLD_IF_FLOWN_BY_HAND = "hold-if-flown-by-hand"


NO_EPOCH: Final = Epoch(0)
"""The lease of a drone that was never held."""


@dataclass(frozen=True)
class Actor:
    """The actor, the parameters of the request, and what the decision depends on beside the lease."""

    user_id: UserId | None
    is_admin: bool = False
    """Of the tower."""
    is_team_admin: bool = False
    """Of the drone's team."""
    is_owner: bool = False
    """They may fly it: they own it, have borrowed it, or fly it for its team."""
    outranked: bool = False
    """An admin of the tower has the controls or assists, and this is none."""
    is_tower: bool = False
    """The tower acts by itself, without a user."""
    holds_another: bool = False
    """An operator who has the controls of a different drone."""
    operator_may_fly: bool = True
    """The one it was taken from is still an owner with an account, and does not hold a different drone."""
    watch: bool = True
    """With TAKE: the operator who is shut out may go on watching."""
    moves_video: bool = False
    """With TAKE: the operator who is shut out may not watch the video."""
    sticks_centred: bool = False
    """With ACCEPT: the sticks are centred."""
    about: UserId | None = None
    """For the tower: the user whom the event concerns. If the part is another's by now, the event came too late."""

    @property
    def may_take(self) -> bool:
        """Whether they may take controls from others at all."""
        return self.is_admin or self.is_team_admin


TOWER: Final = Actor(None, is_tower=True)


@dataclass(frozen=True)
class Lease:
    """`taken_from` is set only while an admin holds what they took; that user is shut out until it is given back.

    `blind`: that user gets no frames either, but while it is offered; `video_moved`: no video. `assistant`: an admin
    whose frames win while they come.
    """

    holder: UserId | None = None
    taken_from: UserId | None = None
    offered: bool = False
    assistant: UserId | None = None
    blind: bool = False
    video_moved: bool = False
    epoch: Epoch = NO_EPOCH

    @property
    def phase(self) -> Phase:
        if self.holder is None:
            return Phase.FREE
        if self.taken_from is None:
            return Phase.HELD
        return Phase.OFFERED if self.offered else Phase.TAKEN

    def next(
        self,
        *,
        holder: UserId | None,
        taken_from: UserId | None = None,
        offered: bool = False,
        assistant: UserId | None = None,
        blind: bool = False,
        video_moved: bool = False,
    ) -> "Lease":
        """The next lease: omitted parts are cleared."""
        return replace(
            self,
            holder=holder,
            taken_from=taken_from,
            offered=offered,
            assistant=assistant,
            blind=blind,
            video_moved=video_moved,
            epoch=Epoch(self.epoch + 1),
        )


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
