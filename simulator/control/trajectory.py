"""The trajectory planner: way-points with times of arrival, take-off, landing. Refuses what cannot be met."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from simulator.control.reference import Reference
from simulator.control.trapezoid import TooFast, Trapezoid, fastest, lasting
from simulator.physics.rotation import Floats


class TrajectoryRefused(ValueError):
    """The plan cannot be flown; the text says which part and why."""


@dataclass(frozen=True, slots=True)
class PlanLimits:
    speed_mps: float = 6.0
    climb_mps: float = 2.5
    descent_mps: float = 1.5
    acceleration_mss: float = 2.0
    climb_acceleration_mss: float = 1.5
    touchdown_mps: float = 0.5
    """Below `flare_m` a landing goes on at this speed."""
    flare_m: float = 2.0


@dataclass(frozen=True, slots=True)
class WayPoint:
    """`arrive_s`: seconds from the start of the plan; None: as early as possible."""

    north_m: float
    east_m: float
    alt_m: float
    arrive_s: float | None = None


@dataclass(frozen=True, slots=True)
class Leg:
    """A straight line from rest to rest."""

    from_s: float
    start_m: Floats
    direction: Floats
    motion: Trapezoid

    @property
    def until_s(self) -> float:
        return self.from_s + self.motion.duration_s

    def at(self, time_s: float) -> tuple[Floats, Floats, Floats]:
        gone, speed, acceleration = self.motion.at(time_s - self.from_s)
        return self.start_m + gone * self.direction, speed * self.direction, acceleration * self.direction


@dataclass(slots=True)
class Trajectory:
    """Legs in the order of time, with pauses between them. Positions are north, east, down."""

    start_m: Floats
    yaw_rad: float = 0.0
    legs: list[Leg] = field(default_factory=list)

    @property
    def duration_s(self) -> float:
        return self.legs[-1].until_s if self.legs else 0.0

    @property
    def end_m(self) -> Floats:
        return self.legs[-1].at(math.inf)[0] if self.legs else self.start_m

    def at(self, time_s: float) -> Reference:
        position, velocity, acceleration = self.start_m, np.zeros(3), np.zeros(3)
        for leg in self.legs:
            if time_s < leg.from_s:
                break
            position, velocity, acceleration = leg.at(time_s)
        return Reference(position, velocity, acceleration, self.yaw_rad)

    def pause(self, duration_s: float) -> None:
        self.legs.append(Leg(self.duration_s + duration_s, self.end_m, np.zeros(3), Trapezoid(0.0, 1.0, 1.0)))

    def fly_to(self, point: WayPoint, limits: PlanLimits, name: str = "way-point") -> None:
        """Raises TrajectoryRefused."""
        values = (point.north_m, point.east_m, point.alt_m, 0.0 if point.arrive_s is None else point.arrive_s)
        if not all(map(math.isfinite, values)):
            raise TrajectoryRefused(f"{name} is not a place")
        if point.alt_m < 0.0:
            raise TrajectoryRefused(f"{name} is below the ground")
        way = np.array([point.north_m, point.east_m, -point.alt_m]) - self.end_m
        distance_m = float(np.linalg.norm(way))
        direction = way / distance_m if distance_m > 0.0 else np.zeros(3)
        speed, acceleration = _limits_along(direction, limits)
        from_s = self.duration_s
        try:
            if point.arrive_s is None:
                motion = fastest(distance_m, speed, acceleration)
            else:
                motion = lasting(distance_m, point.arrive_s - from_s, speed, acceleration)
        except TooFast as error:
            earliest_s = from_s + error.least_s
            raise TrajectoryRefused(
                f"{name} cannot be reached at {point.arrive_s:.1f} s: {earliest_s:.1f} s at the earliest"
            ) from error
        self.legs.append(Leg(from_s, self.end_m, direction, motion))
        if point.arrive_s is not None and self.duration_s < point.arrive_s:  # a way of no length
            self.pause(point.arrive_s - self.duration_s)

    def land(self, limits: PlanLimits) -> None:
        """Down to the flare, then slowly until well below the ground: the ground ends it."""
        height_m = -float(self.end_m[2])
        down = np.array([0.0, 0.0, 1.0])
        if height_m > limits.flare_m:
            motion = fastest(height_m - limits.flare_m, limits.descent_mps, limits.climb_acceleration_mss)
            self.legs.append(Leg(self.duration_s, self.end_m, down, motion))
        slow = fastest(max(-float(self.end_m[2]), 0.0) + 1.0, limits.touchdown_mps, limits.climb_acceleration_mss)
        self.legs.append(Leg(self.duration_s, self.end_m, down, slow))


def plan(
    points: Sequence[WayPoint],
    limits: PlanLimits | None = None,
    *,
    take_off_m: float,
    pause_s: float = 0.0,
    land: bool = True,
    yaw_rad: float = 0.0,
) -> Trajectory:
    """Take-off straight up from the origin, the way-points, and a landing. Raises TrajectoryRefused.

    `pause_s`: rest at each way-point that has no time of arrival after it.
    """
    limits = limits or PlanLimits()
    if not 0.0 < take_off_m < math.inf:
        raise TrajectoryRefused("take-off needs a height above the ground")
    trajectory = Trajectory(np.zeros(3), yaw_rad)
    trajectory.fly_to(WayPoint(0.0, 0.0, take_off_m), limits, "take-off")
    for number, point in enumerate(points, start=1):
        if pause_s:
            trajectory.pause(pause_s)
        trajectory.fly_to(point, limits, f"way-point {number}")
    if land:
        if pause_s:
            trajectory.pause(pause_s)
        trajectory.land(limits)
    return trajectory


def _limits_along(direction: Floats, limits: PlanLimits) -> tuple[float, float]:
    """Returns the speed and the acceleration that keep both the level and the vertical part within the limits."""
    level, down = float(np.hypot(direction[0], direction[1])), float(direction[2])
    vertical_mps = limits.descent_mps if down > 0.0 else limits.climb_mps
    speed = min(_share(limits.speed_mps, level), _share(vertical_mps, abs(down)))
    acceleration = min(_share(limits.acceleration_mss, level), _share(limits.climb_acceleration_mss, abs(down)))
    return (speed, acceleration) if math.isfinite(speed) else (limits.speed_mps, limits.acceleration_mss)


def _share(limit: float, part: float) -> float:
    return limit / part if part > 1e-9 else math.inf
