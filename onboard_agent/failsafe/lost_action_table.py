"""The responses to a lost tower or person, and the phases of a response: the tables that `lost_action.py` runs."""

from enum import StrEnum
from typing import Final

from wire.open_holds import LostAction, LostPhase


class Situation(StrEnum):
    """What the drone is doing when the time is up."""

    GOING_HOME = "going home"
    """The drone already returns or lands."""
    ON_MISSION = "on a mission"
    HELD_ON_MISSION = "held on a mission"
    """The drone holds because of the loss, and flew a mission before."""
    OTHERWISE = "otherwise"
    NO_POSITION = "no position"
    """The drone can neither find home nor keep its place."""


class LossResponse(StrEnum):
    """How the agent responds."""

    RETURN = "return"
    LAND = "land"
    RESUME_MISSION = "resume the mission"
    STAY = "stay"
    """The drone stays as it is until the battery is needed for the way home."""
    STOP_STICKS = "leave it to the autopilot's own failsafe"
    """For a vehicle without known modes."""
    LEAVE = "leave it as it is"


_S = Situation

RESPONSES: Final[dict[tuple[LostAction, Situation], LossResponse]] = {
    (LostAction.RETURN, _S.GOING_HOME): LossResponse.LEAVE,
    (LostAction.RETURN, _S.ON_MISSION): LossResponse.RETURN,
    (LostAction.RETURN, _S.HELD_ON_MISSION): LossResponse.RETURN,
    (LostAction.RETURN, _S.OTHERWISE): LossResponse.RETURN,
    (LostAction.RETURN, _S.NO_POSITION): LossResponse.LAND,
    (LostAction.LAND, _S.GOING_HOME): LossResponse.LEAVE,
    (LostAction.LAND, _S.ON_MISSION): LossResponse.LAND,
    (LostAction.LAND, _S.HELD_ON_MISSION): LossResponse.LAND,
    (LostAction.LAND, _S.OTHERWISE): LossResponse.LAND,
    (LostAction.LAND, _S.NO_POSITION): LossResponse.LAND,
    (LostAction.CONTINUE, _S.GOING_HOME): LossResponse.LEAVE,
    (LostAction.CONTINUE, _S.ON_MISSION): LossResponse.LEAVE,
    (LostAction.CONTINUE, _S.HELD_ON_MISSION): LossResponse.RESUME_MISSION,
    (LostAction.CONTINUE, _S.OTHERWISE): LossResponse.STAY,
    (LostAction.CONTINUE, _S.NO_POSITION): LossResponse.LAND,
    (LostAction.STAY, _S.GOING_HOME): LossResponse.LEAVE,
    (LostAction.STAY, _S.ON_MISSION): LossResponse.STAY,
    (LostAction.STAY, _S.HELD_ON_MISSION): LossResponse.STAY,
    (LostAction.STAY, _S.OTHERWISE): LossResponse.STAY,
    (LostAction.STAY, _S.NO_POSITION): LossResponse.LAND,
}
"""Without a position no drone stays: it drifts, and only the agent's sticks keep its height."""

REPORTED_ACTION: Final[dict[LossResponse, LostAction]] = {
    LossResponse.RETURN: LostAction.RETURN,
    LossResponse.LAND: LostAction.LAND,
    LossResponse.RESUME_MISSION: LostAction.CONTINUE,
    LossResponse.LEAVE: LostAction.CONTINUE,
    LossResponse.STAY: LostAction.STAY,
    LossResponse.STOP_STICKS: LostAction.STAY,
}


class LostEvent(StrEnum):
    """What can happen to a lost action."""

    GONE = "gone"
    """The tower or the person is gone, and the drone is in the air."""
    BACK = "back"
    """The tower is there, and somebody flies."""
    CALLED_OFF = "called off"
    """On the ground, disarmed, or flown by a radio pilot alone."""
    STAY = "stay"
    """A person said so, or the setting is to stay. From now on only the battery counts."""
    COUNT = "count"
    """The tower is gone as well, and "stay" does not apply to that."""
    DUE_MODE = "due, by a mode"
    DUE_NOTHING = "due, nothing to ask for"
    CONFIRMED = "confirmed"


_P = LostPhase
_E = LostEvent

NEXT: Final[dict[tuple[LostPhase, LostEvent], LostPhase]] = {
    (_P.QUIET, _E.GONE): _P.COUNTING,
    (_P.COUNTING, _E.BACK): _P.QUIET,
    (_P.COUNTING, _E.CALLED_OFF): _P.QUIET,
    (_P.COUNTING, _E.STAY): _P.STAYED,
    (_P.COUNTING, _E.DUE_MODE): _P.ASKING,
    (_P.COUNTING, _E.DUE_NOTHING): _P.DONE,
    (_P.STAYED, _E.BACK): _P.QUIET,
    (_P.STAYED, _E.CALLED_OFF): _P.QUIET,
    (_P.STAYED, _E.COUNT): _P.COUNTING,
    (_P.STAYED, _E.DUE_MODE): _P.ASKING,
    (_P.STAYED, _E.DUE_NOTHING): _P.DONE,
    (_P.ASKING, _E.CONFIRMED): _P.DONE,
    (_P.ASKING, _E.BACK): _P.QUIET,
    (_P.ASKING, _E.CALLED_OFF): _P.QUIET,
    (_P.DONE, _E.BACK): _P.QUIET,
    (_P.DONE, _E.CALLED_OFF): _P.QUIET,
}
"""Missing pairs are ignored. The mode does not change when the tower returns."""
