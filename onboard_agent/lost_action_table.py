"""What is done when the tower stays lost, and the phases of doing it: the tables that `lost_action.py` runs."""

from enum import StrEnum
from typing import Final

from wire.control_messages import LostAction


class Situation(StrEnum):
    """What the drone is doing when the time is up."""

    GOING_HOME = "going home"
    """It returns or lands already."""
    ON_MISSION = "on a mission"
    HELD_ON_MISSION = "held on a mission"
    """We hold because of the loss, and before that it flew a mission."""
    OTHERWISE = "otherwise"


class Deed(StrEnum):
    """What is done about it."""

    RETURN = "return"
    LAND = "land"
    RESUME_MISSION = "resume the mission"
    STOP_STICKS = "leave it to the autopilot's own failsafe"
    LEAVE = "leave it as it is"


_S = Situation

DEEDS: Final[dict[tuple[LostAction, Situation], Deed]] = {
    (LostAction.RETURN, _S.GOING_HOME): Deed.LEAVE,
    (LostAction.RETURN, _S.ON_MISSION): Deed.RETURN,
    (LostAction.RETURN, _S.HELD_ON_MISSION): Deed.RETURN,
    (LostAction.RETURN, _S.OTHERWISE): Deed.RETURN,
    (LostAction.LAND, _S.GOING_HOME): Deed.LEAVE,
    (LostAction.LAND, _S.ON_MISSION): Deed.LAND,
    (LostAction.LAND, _S.HELD_ON_MISSION): Deed.LAND,
    (LostAction.LAND, _S.OTHERWISE): Deed.LAND,
    (LostAction.CONTINUE, _S.GOING_HOME): Deed.LEAVE,
    (LostAction.CONTINUE, _S.ON_MISSION): Deed.LEAVE,
    (LostAction.CONTINUE, _S.HELD_ON_MISSION): Deed.RESUME_MISSION,
    (LostAction.CONTINUE, _S.OTHERWISE): Deed.LEAVE,
    (LostAction.NOTHING, _S.GOING_HOME): Deed.LEAVE,
    (LostAction.NOTHING, _S.ON_MISSION): Deed.LEAVE,
    (LostAction.NOTHING, _S.HELD_ON_MISSION): Deed.STOP_STICKS,
    (LostAction.NOTHING, _S.OTHERWISE): Deed.STOP_STICKS,
}


class LostPhase(StrEnum):
    """How far it is."""

    QUIET = "quiet"
    """The tower is there, or the drone is not ours to bring home."""
    COUNTING = "counting"
    ASKING = "asking"
    """The autopilot is asked for the mode until it is confirmed."""
    DONE = "done"


class LostEvent(StrEnum):
    """What can happen."""

    GONE = "gone"
    """The tower is gone for longer than a hold waits, and the drone is in the air."""
    BACK = "back"
    CALLED_OFF = "called off"
    """On the ground, disarmed, or flown by a radio pilot alone."""
    DUE_MODE = "due, by a mode"
    DUE_NOTHING = "due, nothing to ask for"
    CONFIRMED = "confirmed"


_P = LostPhase
_E = LostEvent

NEXT: Final[dict[tuple[LostPhase, LostEvent], LostPhase]] = {
    (_P.QUIET, _E.GONE): _P.COUNTING,
    (_P.COUNTING, _E.BACK): _P.QUIET,
    (_P.COUNTING, _E.CALLED_OFF): _P.QUIET,
    (_P.COUNTING, _E.DUE_MODE): _P.ASKING,
    (_P.COUNTING, _E.DUE_NOTHING): _P.DONE,
    (_P.ASKING, _E.CONFIRMED): _P.DONE,
    (_P.ASKING, _E.BACK): _P.QUIET,
    (_P.ASKING, _E.CALLED_OFF): _P.QUIET,
    (_P.DONE, _E.BACK): _P.QUIET,
    (_P.DONE, _E.CALLED_OFF): _P.QUIET,
}
"""A pair that is missing means nothing. Back is back: the mode is not changed when the tower returns."""
