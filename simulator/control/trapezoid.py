"""Motion along a line: accelerate, cruise, brake. The fastest one, or the one that takes just so long."""

from __future__ import annotations

import math
from dataclasses import dataclass


class TooFast(ValueError):
    """No such motion within the limits. `least_s`: the shortest time that there is one for."""

    def __init__(self, least_s: float) -> None:
        super().__init__(f"takes {least_s:.1f} s at least")
        self.least_s = least_s


@dataclass(frozen=True, slots=True)
class Trapezoid:
    """From rest to rest over `distance_m`, at most `cruise_mps` fast."""

    distance_m: float
    cruise_mps: float
    acceleration_mss: float

    @property
    def ramp_s(self) -> float:
        return self.cruise_mps / self.acceleration_mss

    @property
    def duration_s(self) -> float:
        if self.distance_m == 0.0:
            return 0.0
        return self.distance_m / self.cruise_mps + self.ramp_s

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Returns distance, speed and acceleration."""
        if time_s <= 0.0:
            return 0.0, 0.0, 0.0
        left_s = self.duration_s - time_s
        if left_s <= 0.0:
            return self.distance_m, 0.0, 0.0
        if time_s < self.ramp_s:
            return 0.5 * self.acceleration_mss * time_s**2, self.acceleration_mss * time_s, self.acceleration_mss
        if left_s < self.ramp_s:
            gone = self.distance_m - 0.5 * self.acceleration_mss * left_s**2
            return gone, self.acceleration_mss * left_s, -self.acceleration_mss
        return self.cruise_mps * (time_s - 0.5 * self.ramp_s), self.cruise_mps, 0.0


def fastest(distance_m: float, speed_mps: float, acceleration_mss: float) -> Trapezoid:
    """A short way is a triangle: it never reaches `speed_mps`."""
    peak_mps = math.sqrt(distance_m * acceleration_mss)
    return Trapezoid(distance_m, min(speed_mps, peak_mps) if distance_m > 0.0 else speed_mps, acceleration_mss)


def lasting(distance_m: float, duration_s: float, speed_mps: float, acceleration_mss: float) -> Trapezoid:
    """Returns the motion that arrives after `duration_s`. Raises TooFast."""
    best = fastest(distance_m, speed_mps, acceleration_mss)
    if duration_s < best.duration_s - 1e-9:
        raise TooFast(best.duration_s)
    if distance_m == 0.0:
        return best
    # distance = cruise x (duration - ramp), with ramp = cruise / acceleration: the smaller root cruises longer.
    half = 0.5 * acceleration_mss * duration_s
    cruise = half - math.sqrt(max(half * half - acceleration_mss * distance_m, 0.0))
    return Trapezoid(distance_m, cruise, acceleration_mss)
