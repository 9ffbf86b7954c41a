"""From a goal to the set-point of this moment: a velocity on the way, a place where the drone shall stay. Pure.

The way to a place is flown by velocities, because an autopilot flies to a target as fast as its own parameters say.
"""

from dataclasses import dataclass
from math import hypot, sqrt
from typing import Final

from onboard_agent.autonomy.core.safe_commands import (
    MAX_TURN_DEG_S,
    Goal,
    HoldGoal,
    Limits,
    Motion,
    MoveGoal,
    PlaceGoal,
    turned,
    within,
)

NEAR_M: Final = 0.5
"""Nearer than this the drone is given the place itself."""
ARRIVED_M: Final = 0.7
STILL_M_S: Final = 0.3
TURNED_DEG: Final = 5.0
BRAKES_M_S2: Final = 1.0
APPROACH_PER_S: Final = 0.8
OLD_S: Final = 1.0
"""An older position is no ground to move on."""
EVERY_S: Final = 0.05


@dataclass(frozen=True, slots=True)
class Velocity:
    """m/s north, east and up, and the heading of the nose."""

    north_m_s: float
    east_m_s: float
    up_m_s: float
    heading_deg: float


@dataclass(frozen=True, slots=True)
class Place:
    """Metres from the start and above home."""

    north_m: float
    east_m: float
    height_m: float
    heading_deg: float


Setpoint = Velocity | Place


def apart_deg(one: float, other: float) -> float:
    """Returns the turn from one heading to the other, -180 to 180."""
    return (other - one + 180.0) % 360.0 - 180.0


class Course:
    """Give it a goal with `fly`, and call `setpoint` every EVERY_S."""

    def __init__(self, limits: Limits, heading_deg: float) -> None:
        self.goal: Goal = HoldGoal()
        self.heading_deg = heading_deg
        """Commanded: it moves to the wanted one with a bounded rate."""
        self._limits = limits
        self._kept: tuple[float, float, float] | None = None

    def fly(self, goal: Goal) -> None:
        """Replaces the goal."""
        self.goal, self._kept = goal, None

    def expired(self, now: float) -> bool:
        """Whether the time of the goal is over."""
        return not isinstance(self.goal, HoldGoal) and now >= self.goal.until

    def reached(self, motion: Motion) -> bool:
        """Whether the drone is at the place, still, with its nose where it should be."""
        goal = self.goal
        if not isinstance(goal, PlaceGoal):
            return False
        off_m = hypot(goal.north_m - motion.north_m, goal.east_m - motion.east_m, goal.height_m - motion.height_m)
        is_turned = goal.heading_deg is None or abs(apart_deg(motion.heading_deg, goal.heading_deg)) <= TURNED_DEG
        return off_m <= ARRIVED_M and speed_of(motion) <= STILL_M_S and is_turned

    def setpoint(self, motion: Motion, now: float) -> Setpoint:
        """Returns the set-point of this moment."""
        goal = self.goal
        if now - motion.at > OLD_S:
            return Velocity(0.0, 0.0, 0.0, self.heading_deg)
        if isinstance(goal, MoveGoal):
            self.heading_deg = (self.heading_deg + goal.turn_deg_s * EVERY_S) % 360.0
            north, east = turned(goal.forward_m_s, goal.right_m_s, self.heading_deg)
            return Velocity(*within((north, east, goal.up_m_s), motion, self._limits), self.heading_deg)
        if isinstance(goal, PlaceGoal):
            if goal.heading_deg is not None:
                self._turn_to(goal.heading_deg)
            return self._towards(goal, motion)
        if self._kept is None and speed_of(motion) <= STILL_M_S:
            self._kept = (motion.north_m, motion.east_m, motion.height_m)
        if self._kept is None:
            return Velocity(0.0, 0.0, 0.0, self.heading_deg)
        return Place(*self._kept, self.heading_deg)

    def _turn_to(self, heading_deg: float) -> None:
        step = MAX_TURN_DEG_S * EVERY_S
        left = apart_deg(self.heading_deg, heading_deg)
        self.heading_deg = (self.heading_deg + max(-step, min(left, step))) % 360.0

    def _towards(self, goal: PlaceGoal, motion: Motion) -> Setpoint:
        way = (goal.north_m - motion.north_m, goal.east_m - motion.east_m, goal.height_m - motion.height_m)
        off_m = hypot(*way)
        if off_m <= NEAR_M:
            return Place(goal.north_m, goal.east_m, goal.height_m, self.heading_deg)
        speed = min(goal.speed_m_s, off_m * APPROACH_PER_S, sqrt(2.0 * BRAKES_M_S2 * off_m))
        north, east, up = (part / off_m * speed for part in way)
        return Velocity(*within((north, east, up), motion, self._limits), self.heading_deg)


def speed_of(motion: Motion) -> float:
    """Returns the speed in m/s, in whatever direction."""
    return hypot(motion.north_m_s, motion.east_m_s, motion.up_m_s)
