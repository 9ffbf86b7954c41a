"""How near is too near, and how sure one can be of where a drone is. Pure."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple

from server.airspace.core.separation.approach import Approach, conflict_ahead
from server.airspace.core.separation.motion import Motion, Relative

STALE_S: Final = 3.0
"""A position older than this tells nothing about the next half minute."""
TURNS_BY_M_S2: Final = 2.0
"""How hard a copter on a mission turns or brakes: since its last position it may have left its course by half of this
times the square of the age. In height half as much."""


class Level(IntEnum):
    CLEAR = 0
    CAUTION = 1
    WARNING = 2


@dataclass(frozen=True)
class SeparationBounds:
    """Metres and seconds of a caution; a warning is half of the metres, and a third of the seconds: what must be acted
    on now, while most of what is further ahead will have turned by then. `horizontal_m` 0: nothing is watched."""

    horizontal_m: float = 15.0
    vertical_m: float = 10.0
    ahead_s: float = 30.0


class Judged(NamedTuple):
    level: Level
    approach: Approach


def drift_m(motion: Motion, now: float) -> float:
    """By how much a drone may be beside where its last position and speed put it."""
    age = max(0.0, now - motion.at)
    return 0.5 * TURNS_BY_M_S2 * age * age


def judge(
    own: Motion, other: Motion, seen: Relative, bounds: SeparationBounds, now: float, *, widened: float = 1.0
) -> Judged | None:
    """The closest approach of two drones. `widened`: multiplies the distances. None: they stay apart."""
    drift = drift_m(own, now) + drift_m(other, now)
    for level, share, ahead in ((Level.WARNING, 1 / 2, 1 / 3), (Level.CAUTION, 1.0, 1.0)):
        approach = conflict_ahead(
            seen,
            horizontal_m=bounds.horizontal_m * share * widened + drift,
            vertical_m=bounds.vertical_m * share * widened + drift / 2,
            ahead_s=bounds.ahead_s * ahead,
        )
        if approach is not None:
            return Judged(level, approach)
    return None
