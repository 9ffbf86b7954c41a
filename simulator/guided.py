"""GUIDED: flies to the position, or at the velocity, that a ground station commands."""

from __future__ import annotations

import math
from dataclasses import dataclass

from simulator.behaviours import Behaviour
from simulator.flight_constants import TICK_S
from simulator.flight_state import FlightState
from simulator.orbit import look_at_roi

TURN_RATE_RPS = math.radians(60.0)


@dataclass(frozen=True, slots=True)
class GoTo:
    """A position relative to the origin, metres. `yaw_rad` None: nose in the direction of flight."""

    north_m: float
    east_m: float
    alt_m: float
    yaw_rad: float | None = None


@dataclass(frozen=True, slots=True)
class FlyWith:
    """A velocity, metres per second, that expires GUID_TIMEOUT after `since_s`."""

    vn_mps: float
    ve_mps: float
    climb_mps: float
    since_s: float
    yaw_rad: float | None = None
    yaw_rate_rps: float | None = None


@dataclass(frozen=True, slots=True)
class TakeOff:
    alt_m: float


class Guided(Behaviour):
    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self.goal: GoTo | FlyWith | TakeOff | None = None
        self._paused = False

    @property
    def waits_to_take_off(self) -> bool:
        return isinstance(self.goal, TakeOff)

    def enter(self) -> None:
        self.goal = None
        self._paused = False

    def take_off(self, alt_over_home_m: float) -> bool:
        self.goal = TakeOff(alt_over_home_m + self.flight.home_local()[2])
        self.flight.lift_off()
        return True

    def go(self, goal: GoTo | FlyWith) -> None:
        self._paused = False
        if not self.flight.landed:  # on the ground only a take-off has an effect
            self.goal = goal

    def pause(self) -> bool:
        self._paused = True
        return True

    def resume(self) -> bool:
        self._paused = False
        return True

    def run(self) -> None:
        flight, target, goal = self.flight, self.flight.target, self.goal
        if flight.landed:
            flight.rest()
            return
        limits = flight.limits()
        if self._paused or goal is None:
            target.climb_with(0.0, limits, TICK_S)
            target.fly_with(0.0, 0.0, limits, TICK_S)
        elif isinstance(goal, TakeOff):
            target.climb_to(goal.alt_m, limits, TICK_S)
            target.fly_with(0.0, 0.0, limits, TICK_S)
            if abs(flight.body.alt_m - goal.alt_m) < 0.1 and abs(flight.body.vd_mps) < 0.1:
                self.goal = GoTo(target.north_m, target.east_m, goal.alt_m)
        elif isinstance(goal, GoTo):
            target.climb_to(goal.alt_m, limits, TICK_S)
            target.fly_to(goal.north_m, goal.east_m, limits, flight.body, TICK_S)
        else:
            self._fly_with(goal)
        self._turn()
        flight.fly()

    def _fly_with(self, goal: FlyWith) -> None:
        flight, limits = self.flight, self.flight.limits()
        if flight.now_s - goal.since_s > flight.parameters["GUID_TIMEOUT"]:
            goal = FlyWith(0.0, 0.0, 0.0, goal.since_s)
        climb = max(-limits.descent_mps, min(goal.climb_mps, limits.climb_mps))
        flight.target.climb_with(climb, limits, TICK_S)
        flight.target.fly_with(goal.vn_mps, goal.ve_mps, limits, TICK_S)
        if goal.yaw_rate_rps is not None:
            flight.attitude.turn(goal.yaw_rate_rps, TICK_S)

    def _turn(self) -> None:
        flight, goal = self.flight, self.goal
        if look_at_roi(flight):
            return
        if flight.yaw_override_rad is not None:
            flight.attitude.turn_towards(flight.yaw_override_rad, TURN_RATE_RPS, TICK_S)
        elif isinstance(goal, GoTo | FlyWith) and goal.yaw_rad is not None:
            flight.attitude.turn_towards(goal.yaw_rad, TURN_RATE_RPS, TICK_S)
        elif isinstance(goal, GoTo):
            look_ahead(self, goal.north_m, goal.east_m)


def look_ahead(behaviour: Behaviour, north_m: float, east_m: float) -> None:
    """Turns towards a position that is far enough away to have a direction."""
    flight = behaviour.flight
    gap_n, gap_e = north_m - flight.body.north_m, east_m - flight.body.east_m
    if math.hypot(gap_n, gap_e) > 2.0 and flight.parameters.whole("WP_YAW_BEHAVIOR"):
        flight.attitude.turn_towards(math.atan2(gap_e, gap_n), TURN_RATE_RPS, TICK_S)
