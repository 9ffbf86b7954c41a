"""A lying eight, entered and left smoothly: position, velocity and acceleration fit each other at every instant."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simulator.control.reference import Reference
from simulator.control.trajectory import PlanLimits, Trajectory, TrajectoryRefused, plan


@dataclass(frozen=True, slots=True)
class FigureOfEight:
    """North = size x sin(phase), east = size / 2 x sin(2 phase), `rounds` times in `period_s` each."""

    size_m: float
    period_s: float
    alt_m: float
    rounds: int = 2
    ease_s: float = 4.0
    """For so long the phase speeds up, and at the end slows down."""
    yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        limits = PlanLimits(acceleration_mss=4.0, speed_mps=8.0)
        if not (self.size_m > 0.0 and self.period_s > 0.0 and self.alt_m > 0.0 and self.ease_s > 0.0):
            raise TrajectoryRefused("a figure of eight has a size, a period, a height and an ease above 0")
        if self.rounds < 1:
            raise TrajectoryRefused(f"a figure of eight is flown 1 time or more, not {self.rounds} times")
        if self.peak_mps > limits.speed_mps or self.peak_mss > limits.acceleration_mss:
            raise TrajectoryRefused(f"figure of eight: {self.peak_mps:.1f} m/s, {self.peak_mss:.1f} m/s^2 are too fast")

    @property
    def _rate(self) -> float:
        return 2.0 * math.pi / self.period_s

    @property
    def peak_mps(self) -> float:
        return math.sqrt(2.0) * self.size_m * self._rate

    @property
    def peak_mss(self) -> float:
        """Of the steady part."""
        return 2.125 * self.size_m * self._rate**2

    @property
    def duration_s(self) -> float:
        return self.rounds * self.period_s + self.ease_s

    def at(self, time_s: float) -> Reference:
        phase, rate, change = self._phase(min(max(time_s, 0.0), self.duration_s))
        s1, c1, s2, c2 = math.sin(phase), math.cos(phase), math.sin(2.0 * phase), math.cos(2.0 * phase)
        size = self.size_m
        return Reference(
            np.array([size * s1, 0.5 * size * s2, -self.alt_m]),
            np.array([size * c1 * rate, size * c2 * rate, 0.0]),
            np.array([size * (c1 * change - s1 * rate * rate), size * (c2 * change - 2.0 * s2 * rate * rate), 0.0]),
            self.yaw_rad,
        )

    def _phase(self, time_s: float) -> tuple[float, float, float]:
        """Returns the phase, its rate and the change of that: eased in and out by half a cosine."""
        ease, full = self.ease_s, self._rate
        end_s = self.duration_s - time_s
        if time_s < ease:
            turn = math.pi * time_s / ease
            gone = full * 0.5 * (time_s - ease / math.pi * math.sin(turn))
            return gone, full * 0.5 * (1.0 - math.cos(turn)), full * 0.5 * math.pi / ease * math.sin(turn)
        if end_s < ease:
            turn = math.pi * end_s / ease
            left = full * 0.5 * (end_s - ease / math.pi * math.sin(turn))
            whole = 2.0 * math.pi * self.rounds
            return whole - left, full * 0.5 * (1.0 - math.cos(turn)), -full * 0.5 * math.pi / ease * math.sin(turn)
        return full * (time_s - 0.5 * ease), full, 0.0


class EightFlight:
    """Take-off at the origin, the eight, a rest and the landing at the origin."""

    def __init__(self, eight: FigureOfEight, pause_s: float = 1.0) -> None:
        self._eight = eight
        self._climb = plan([], take_off_m=eight.alt_m, land=False, yaw_rad=eight.yaw_rad)
        self._climb.pause(pause_s)
        self._landing = Trajectory(self._climb.end_m, eight.yaw_rad)
        self._landing.pause(pause_s)
        self._landing.land(PlanLimits())

    @property
    def duration_s(self) -> float:
        return self._climb.duration_s + self._eight.duration_s + self._landing.duration_s

    def at(self, time_s: float) -> Reference:
        in_eight_s = time_s - self._climb.duration_s
        if in_eight_s < 0.0:
            return self._climb.at(time_s)
        landing_s = in_eight_s - self._eight.duration_s
        return self._eight.at(in_eight_s) if landing_s < 0.0 else self._landing.at(landing_s)
