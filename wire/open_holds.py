"""The messages of agent and tower about an open hold and a lost action (docs/wire-protocol.md, 2).

A hold is open from its order until somebody flies the drone, the lost action is done, or the drone is disarmed. Both
sides list OPEN_HOLDS in `takes`; a side that does not receives neither message.
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
    """A mission continues; anything else stays."""
    STAY = "stay"
    """Until the battery falls to the level that the return needs; then it returns."""


class HoldStage(StrEnum):
    """The stage of an open hold."""

    NONE = "none"
    """No mode of the hold is confirmed."""
    ALTITUDE = "altitude"
    """Stage one: altitude hold (or a rung of the drone's ladder), with the agent's centred sticks."""
    STAY = "stay"
    """Stage two: a mode that holds position without sticks."""


class AfterSticks(StrEnum):
    """What the autopilot does if the agent's sticks stop or the agent dies."""

    STAYS = "stays"
    SINKS = "sinks"
    """The receiver's resting throttle applies again in a mode that uses it."""
    RETURNS = "returns"
    LANDS = "lands"
    UNKNOWN = "unknown"


class Lost(StrEnum):
    """Who is lost."""

    TOWER = "tower"
    PERSON = "person"


class LostPhase(StrEnum):
    """The phase of the lost action."""

    QUIET = "quiet"
    """Nobody is lost."""
    COUNTING = "counting"
    STAYED = "stayed"
    """Somebody chose "stay", or staying is the action: the battery ends it."""
    ASKING = "asking"
    """The agent requests the mode until the autopilot confirms it."""
    DONE = "done"


class HoldState(msgspec.Struct, frozen=True, tag="hold_state", tag_field="type", kw_only=True):
    """Agent to tower: the present state of the open hold and the lost action. On each change, every 5 s while either is
    active, and first on each new link.

    `number` grows with each message of an agent process. `mode`: the autopilot's mode, by name. `sticks`: the agent
    sends centred sticks. `waiting_for`: why stage two is not reached, for people. `action`: what will be done, or is
    being done, after the situation was checked: `land` if `return` has no position. `due_in_s`: None except while
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
    """Tower to agent: somebody chose "stay". The lost action for a lost person waits for ten minutes, until the battery
    is at the level that the return needs, or until a hold begins again."""

    order_id: U32
    by: Annotated[str, msgspec.Meta(max_length=80)]


HoldToTower = HoldState
HoldToAgent = Stay
