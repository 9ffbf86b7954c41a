"""The types of the lease table: phases, events, orders, the lease and the actor. Contains no rules."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from wire.ids import Epoch, UserId


class Phase(StrEnum):
    """Derived from a lease."""

    FREE = "free"
    """Nobody has the controls."""
    HELD = "held"
    """A user has them, perhaps with an admin who assists."""
    TAKEN = "taken"
    """An admin has taken them from an operator, who is shut out."""
    OFFERED = "offered"
    """As TAKEN, and offered back: the operator has not confirmed "I have control" yet."""


class Event(StrEnum):
    """A request of a user, or something that has happened."""

    ACQUIRE = "acquire"
    RELEASE = "release"
    TAKE = "take"
    GIVE = "give"
    ACCEPT = "accept"
    ASSIST = "assist"
    ASSIST_END = "assist-end"
    TURN = "turn"
    """The turn passes from holder to assistant or back: the other one's frames pass from now on."""
    REVOKE = "revoke"
    FORGET = "forget"
    """The operator from whom the controls were taken has lost the right to them."""
    OFFER_LAPSED = "offer-lapsed"
    EXPIRE = "expire"
    """The holder's browsers have been disconnected for the whole grace time."""


class Order(StrEnum):
    """An action required besides the change itself."""

    HOLD = "hold"
    HOLD_IF_FLOWN_BY_HAND = "hold-if-flown-by-hand"


NO_EPOCH: Final = Epoch(0)
"""The epoch of a drone that never had a holder."""


@dataclass(frozen=True)
class Actor:
    """Who asks, the parameters of the request, and facts that the decision depends on besides the lease."""

    user_id: UserId | None
    is_admin: bool = False
    """An admin of the tower."""
    is_team_admin: bool = False
    """An admin of the team that the drone belongs to."""
    is_owner: bool = False
    """May fly the drone: as owner, borrower, or for its team."""
    outranked: bool = False
    """An admin of the tower has the controls or assists, and this actor is not one."""
    is_tower: bool = False
    """The tower acts by itself, without a user."""
    holds_another: bool = False
    """An operator who already holds a different drone."""
    operator_may_fly: bool = True
    """The operator it was taken from still owns it, has an account, and does not hold a different drone."""
    watch: bool = True
    """With TAKE: the operator who is shut out may keep watching."""
    moves_video: bool = False
    """With TAKE: the operator who is shut out may not watch the video."""
    sticks_centred: bool = False
    """With ACCEPT: the user confirms that the sticks are centred."""
    about: UserId | None = None
    """For events of the tower: the user concerned. If another user is in that place by now, the event is too late."""

    @property
    def may_take(self) -> bool:
        """Whether they may take controls from other users at all."""
        return self.is_admin or self.is_team_admin


TOWER: Final = Actor(None, is_tower=True)


@dataclass(frozen=True)
class Lease:
    """`taken_from` is set only while an admin holds what they took; that user is shut out until it is given back.

    `view_taken`: that user gets no frames either, except while the drone is offered; `video_moved`: no video.
    `assistant`: an admin whose frames take precedence while they arrive.
    """

    holder: UserId | None = None
    taken_from: UserId | None = None
    offered: bool = False
    assistant: UserId | None = None
    view_taken: bool = False
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
        view_taken: bool = False,
        video_moved: bool = False,
    ) -> "Lease":
        """Returns the next lease; fields that are not given are reset."""
        return replace(
            self,
            holder=holder,
            taken_from=taken_from,
            offered=offered,
            assistant=assistant,
            view_taken=view_taken,
            video_moved=video_moved,
            epoch=Epoch(self.epoch + 1),
        )


@dataclass(frozen=True)
class Changed:
    """The new lease, with the orders to carry out."""

    lease: Lease
    orders: tuple[Order, ...] = ()


@dataclass(frozen=True)
class Refused:
    """The reason. `code` is for programs, `words` for people."""

    code: str
    words: str


Outcome = Changed | Refused
Rule = Callable[[Lease, Actor], Outcome]
