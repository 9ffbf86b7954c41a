"""LAND and RTL: descending, and returning home."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum, auto

from simulator.behaviours import Behaviour
from simulator.flight_constants import TICK_S
from simulator.flight_state import FlightState
from simulator.notices import Severity
from simulator.piloted import lean_of_sticks, turn_with_stick
from simulator.rally import ReturnPoint, nearest_return_point

RTL_MIN_CONE_SLOPE = 0.5
RTL_ALT_MAX_M = 3000.0
ARRIVED_M = 1.0
FAILSAFE_LAND_WAIT_S = 4.0


def descend(behaviour: Behaviour, *, waiting: bool = False) -> None:
    """Flies one tick of a landing on the spot or on a target, or of the wait before it; without a position, the pilot's
    sticks lean it."""
    flight = behaviour.flight
    if flight.landed:
        flight.rest()
        return
    parameters, limits = flight.parameters, flight.limits()
    slow = max(parameters["LAND_SPEED"] / 100.0, 0.3)
    fast = parameters["LAND_SPEED_HIGH"] / 100.0 or limits.descent_mps
    high_m = flight.alt_over_home_m() - parameters["LAND_ALT_LOW"] / 100.0
    wanted = max(slow, min(fast, slow + max(high_m, 0.0)))
    target = flight.precision.target_from_here() if flight.estimator.position_ok else None
    climb_mps = -wanted if target is None else flight.precision.climb_mps(-wanted, flight)
    flight.target.climb_with(0.0 if waiting else climb_mps, limits, TICK_S)
    if flight.body.on_ground:
        flight.target.alt_m = max(flight.target.alt_m, flight.body.alt_m - 0.5)
    if target is None:
        flight.target.fly_with(0.0, 0.0, limits, TICK_S)
    else:
        north_m, east_m = flight.body.north_m + target[0], flight.body.east_m + target[1]
        flight.target.fly_to(north_m, east_m, limits, flight.body, TICK_S)
    if flight.estimator.position_ok:
        flight.fly()
    else:
        turn_with_stick(behaviour)
        flight.fly(lean_of_sticks(behaviour))


class Land(Behaviour):
    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self._waits_until_s = 0.0

    @property
    def disarms_on_landing(self) -> bool:
        return True

    def enter(self) -> None:
        self._waits_until_s = 0.0

    def wait_first(self) -> None:
        """Stays at this height for a while first, as after a failsafe."""
        self._waits_until_s = self.flight.now_s + FAILSAFE_LAND_WAIT_S

    def run(self) -> None:
        descend(self, waiting=self.flight.now_s < self._waits_until_s)


class Leg(Enum):
    CLIMB = auto()
    RETURN = auto()
    WAIT = auto()
    DESCEND = auto()


class ReturnToLaunch(Behaviour):
    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self.leg = Leg.CLIMB
        self.goal = ReturnPoint(0.0, 0.0)
        self._alt_m = 0.0
        self._start = (0.0, 0.0)
        self._waiting_since_s = 0.0

    @property
    def disarms_on_landing(self) -> bool:
        return self.leg is Leg.DESCEND

    def enter(self) -> None:
        flight, parameters = self.flight, self.flight.parameters
        self.goal = nearest_return_point(flight)
        _, _, home_alt = flight.home_local()
        alt = flight.alt_over_home_m()
        distance = math.hypot(self.goal.north_m - flight.body.north_m, self.goal.east_m - flight.body.east_m)
        lowest_m = max(2.0, alt + max(parameters["RTL_CLIMB_MIN"] / 100.0, 0.0))
        return_alt = self.goal.alt_over_home_m
        if return_alt is None:
            return_alt = parameters["RTL_ALT"] / 100.0
        wanted = max(min(return_alt, RTL_ALT_MAX_M), lowest_m)
        slope = parameters["RTL_CONE_SLOPE"]
        if slope >= RTL_MIN_CONE_SLOPE:
            wanted = max(alt, min(wanted, max(distance * slope, lowest_m)))
        self._alt_m = wanted + home_alt
        self._start = (flight.body.north_m, flight.body.east_m)
        self.leg = Leg.CLIMB

    def run(self) -> None:
        flight, target = self.flight, self.flight.target
        if flight.landed:
            flight.rest()
            return
        if self.leg is Leg.DESCEND:
            descend(self)
            return
        limits = flight.limits()
        if flight.parameters["RTL_SPEED"] > 0:
            limits = replace(limits, speed_mps=flight.parameters["RTL_SPEED"] / 100.0)
        target.climb_to(self._alt_m, limits, TICK_S)
        if self.leg is Leg.CLIMB:
            target.fly_with(0.0, 0.0, limits, TICK_S)
            if abs(flight.body.alt_m - self._alt_m) < 0.3:
                self.leg = Leg.RETURN
        else:
            goal_n, goal_e = self.goal.north_m, self.goal.east_m
            gap_n, gap_e = goal_n - flight.body.north_m, goal_e - flight.body.east_m
            target.fly_to(goal_n, goal_e, limits, flight.body, TICK_S)
            if math.hypot(gap_n, gap_e) > 2.0 and flight.parameters.whole("WP_YAW_BEHAVIOR") == 1:
                flight.attitude.turn_towards(math.atan2(gap_e, gap_n), math.radians(60.0), TICK_S)
            self._count_arrival(math.hypot(gap_n, gap_e))
        flight.fly()

    def _count_arrival(self, distance_m: float) -> None:
        flight = self.flight
        slow = flight.body.ground_speed_mps() < 0.5
        if self.leg is Leg.RETURN and distance_m < ARRIVED_M and slow:
            self.leg, self._waiting_since_s = Leg.WAIT, flight.now_s
        elif self.leg is Leg.WAIT:
            wait_s = flight.parameters["RTL_LOIT_TIME"] / 1000.0
            if flight.now_s - self._waiting_since_s >= wait_s:
                self.leg = Leg.DESCEND
                flight.notify(Severity.INFO, "RTL: landing")
