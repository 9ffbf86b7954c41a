"""The safe-command step: every direction of a controller is judged here, and every velocity is bounded here. Pure.

Rules, each tested:
- A number that is not finite is refused, and so is a place beyond the limits in height or distance.
- A speed above the limit is reduced to it, and the acknowledgement says so.
- A direction has a time, after which the drone holds.
- Whatever the direction, no velocity leads beyond the limits: it shrinks to nothing on the way there.
"""

from dataclasses import dataclass
from math import cos, hypot, isfinite, radians, sin
from typing import Final

import msgspec

from onboard_agent.autonomy.core.directions import Direction, GoBy, GoTo, Hold, Move, Turn
from onboard_agent.autonomy.core.local_plane import LocalPlane

MAX_MOVE_S: Final = 5.0
MAX_WITHIN_S: Final = 300.0
MAX_CLIMB_M_S: Final = 3.0
MAX_DESCENT_M_S: Final = 1.5
"""A faster vertical descent leads a multicopter into its own downwash."""
MAX_TURN_DEG_S: Final = 45.0
MAX_TURN_DEG: Final = 180.0
"""The nose turns the short way to the heading where the turn ends."""
TURN_WITHIN_S: Final = 20.0
SHRINKS_PER_S: Final = 0.5
"""A drone this many seconds' inverse from a limit flies towards it with the distance times this, at most."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Metres above home, metres over ground from the start, m/s."""

    max_speed_m_s: float
    min_height_m: float
    max_height_m: float
    max_distance_m: float


@dataclass(frozen=True, slots=True)
class Motion:
    """Where the drone is, from the start, and how it moves. `at`: when, on the clock of `now`."""

    north_m: float
    east_m: float
    height_m: float
    north_m_s: float
    east_m_s: float
    up_m_s: float
    heading_deg: float
    at: float


@dataclass(frozen=True, slots=True)
class MoveGoal:
    """Velocities in the horizontal plane are relative to the nose."""

    forward_m_s: float
    right_m_s: float
    up_m_s: float
    turn_deg_s: float
    until: float


@dataclass(frozen=True, slots=True)
class PlaceGoal:
    """`heading_deg` None: as it is."""

    north_m: float
    east_m: float
    height_m: float
    speed_m_s: float
    until: float
    heading_deg: float | None = None


@dataclass(frozen=True, slots=True)
class HoldGoal:
    """Stop, and keep the place."""


Goal = MoveGoal | PlaceGoal | HoldGoal


@dataclass(frozen=True, slots=True)
class Judged:
    """`goal` None: refused, and `words` say why. `bounded`: a speed or a time was reduced."""

    goal: Goal | None
    words: str = ""
    bounded: bool = False


def judge(direction: Direction, motion: Motion, plane: LocalPlane, limits: Limits, now: float) -> Judged:
    """Judges a direction that set-points carry out. Take-off, landing and the end are the flight's."""
    numbers = [value for value in msgspec.structs.astuple(direction) if isinstance(value, float | int)]
    if not all(isfinite(value) for value in numbers):
        return Judged(None, "a number is not finite")
    match direction:
        case Move():
            return _move(direction, limits, now)
        case Turn(by_deg=by):
            turn = max(-MAX_TURN_DEG, min(by, MAX_TURN_DEG))
            heading = (motion.heading_deg + turn) % 360.0
            place = (motion.north_m, motion.east_m, motion.height_m)
            return Judged(PlaceGoal(*place, 1.0, now + TURN_WITHIN_S, heading), bounded=turn != by)
        case GoBy():
            north, east = turned(direction.forward_m, direction.right_m, motion.heading_deg)
            place = (motion.north_m + north, motion.east_m + east, motion.height_m + direction.up_m)
            return _place(place, direction.speed_m_s, direction.within_s, limits, now)
        case GoTo():
            if abs(direction.lat_deg) > 90.0 or abs(direction.lon_deg) > 180.0:
                return Judged(None, "there is no such place on the map")
            place = (*plane.local(direction.lat_deg, direction.lon_deg), direction.height_m)
            return _place(place, direction.speed_m_s, direction.within_s, limits, now)
        case Hold():
            return Judged(HoldGoal())
        case _:
            return Judged(None, "it is no direction for set-points")


def _move(direction: Move, limits: Limits, now: float) -> Judged:
    if direction.for_s <= 0:
        return Judged(None, "it has no time")
    forward, right = _shortened(direction.forward_m_s, direction.right_m_s, limits.max_speed_m_s)
    up = _vertical(direction.up_m_s, limits)
    turn = max(-MAX_TURN_DEG_S, min(direction.turn_deg_s, MAX_TURN_DEG_S))
    for_s = min(direction.for_s, MAX_MOVE_S)
    asked = (direction.forward_m_s, direction.right_m_s, direction.up_m_s, direction.turn_deg_s, direction.for_s)
    return Judged(MoveGoal(forward, right, up, turn, now + for_s), bounded=asked != (forward, right, up, turn, for_s))


def _place(place: tuple[float, float, float], speed_m_s: float, within_s: float, limits: Limits, now: float) -> Judged:
    north, east, height = place
    if speed_m_s <= 0 or within_s <= 0:
        return Judged(None, "it has no speed or no time")
    away = hypot(north, east)
    if away > limits.max_distance_m:
        return Judged(None, f"{away:.0f} m from the start: {limits.max_distance_m:g} m is the maximum")
    if not limits.min_height_m <= height <= limits.max_height_m:
        between = f"{limits.min_height_m:g} to {limits.max_height_m:g} m"
        return Judged(None, f"{height:.1f} m above home: {between} are permitted")
    speed, time_s = min(speed_m_s, limits.max_speed_m_s), min(within_s, MAX_WITHIN_S)
    bounded = (speed, time_s) != (speed_m_s, within_s)
    return Judged(PlaceGoal(north, east, height, speed, now + time_s), bounded=bounded)


def within(velocity: tuple[float, float, float], motion: Motion, limits: Limits) -> tuple[float, float, float]:
    """Returns the velocity north, east and up that the limits permit at this place."""
    north, east = _shortened(velocity[0], velocity[1], limits.max_speed_m_s)
    away = hypot(motion.north_m, motion.east_m)
    if away > 1.0:
        out_north, out_east = motion.north_m / away, motion.east_m / away
        excess = north * out_north + east * out_east - _room(limits.max_distance_m - away)
        if excess > 0:
            north, east = north - excess * out_north, east - excess * out_east
    up = _vertical(velocity[2], limits)
    up = min(up, _room(limits.max_height_m - motion.height_m))
    up = max(up, -_room(motion.height_m - limits.min_height_m))
    return north, east, up


def turned(forward: float, right: float, heading_deg: float) -> tuple[float, float]:
    """Returns what is forward and right of this heading as north and east."""
    nose = radians(heading_deg)
    return forward * cos(nose) - right * sin(nose), forward * sin(nose) + right * cos(nose)


def _room(distance_m: float) -> float:
    return max(0.0, distance_m * SHRINKS_PER_S)


def _vertical(up_m_s: float, limits: Limits) -> float:
    fastest = limits.max_speed_m_s
    return max(-min(MAX_DESCENT_M_S, fastest), min(up_m_s, MAX_CLIMB_M_S, fastest))


def _shortened(one: float, other: float, longest: float) -> tuple[float, float]:
    length = hypot(one, other)
    return (one, other) if length <= longest else (one * longest / length, other * longest / length)
