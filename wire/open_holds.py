"""Messages between agent and tower about an open hold and a lost action (docs/wire-protocol.md, 2).

A hold is open from its order until somebody flies the drone, the lost action is done, or the drone is disarmed. Both
sides name OPEN_HOLDS in `takes`; a side that does not gets neither message.
"""

from enum import StrEnum
from typing import Annotated, Final

import msgspec

OPEN_HOLDS: Final = "open-holds"

U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
Words = Annotated[str, msgspec.Meta(max_length=300)]


class LostAction(StrEnum):
    """What the drone does when the tower or the person stays away."""

    RETURN = "return"
    LAND = "land"
    CONTINUE = "continue"
    """A mission goes on; anything else stays."""
    STAY = "stay"
    """Until the battery is at the level that the way home needs; then it returns."""


class HoldStage(StrEnum):
    """Stage of an open hold."""

    NONE = "none"
    """No mode of the hold is confirmed."""
    ALTITUDE = "altitude"
    """Stage one: altitude hold (or a rung of the drone's ladder), with the agent's centred sticks."""
    STAY = "stay"
    """Stage two: a mode that stays in place without sticks."""


class AfterSticks(StrEnum):
    """What the autopilot does if the agent's sticks stop or the agent dies."""

    STAYS = "stays"
    SINKS = "sinks"
    """A receiver's resting throttle comes back in a mode that uses it."""
    RETURNS = "returns"
    LANDS = "lands"
    UNKNOWN = "unknown"


class Lost(StrEnum):
    """Who is away."""

    TOWER = "tower"
    PERSON = "person"


class LostPhase(StrEnum):
    """Phase of the lost action."""

    QUIET = "quiet"
    """Nobody is lost."""
    COUNTING = "counting"
    STAYED = "stayed"
    """A person said "stay", or staying is the action: the battery ends it."""
    ASKING = "asking"
    """The mode is requested until the autopilot confirms it."""
    DONE = "done"


class HoldState(msgspec.Struct, frozen=True, tag="hold_state", tag_field="type", kw_only=True):
    """Agent to tower: the open hold and the lost action as they are now. On each change, each 5 s while either is
    going on, and first on each new link.

    `number` grows with each of an agent process. `mode`: the autopilot's mode, by name. `sticks`: the agent keeps
    centred sticks coming. `waiting_for`: why stage two is not reached, for people. `action`: what will be done, or is
    being done, after the situation was looked at: `land` where `return` has no position. `due_in_s`: None but while
    counting.
    """

    number: U32
    open: bool
    stage: HoldStage
    mode: Annotated[str, msgspec.Meta(max_length=40)]
    sticks: bool
    after_sticks: AfterSticks
    waiting_for: Words = ""
    lost: Lost | None = None
    phase: LostPhase = LostPhase.QUIET
    action: LostAction | None = None
    due_in_s: float | None = None
    detail: Words = ""


class Stay(msgspec.Struct, frozen=True, tag="stay", tag_field="type", kw_only=True):
    """Tower to agent: a person said "stay". The lost action for a lost person waits until the battery is at the level
    needed for the way home, or until another hold begins."""

    order_id: U32
    by: Annotated[str, msgspec.Meta(max_length=80)]


HoldToTower = HoldState
HoldToAgent = Stay
