"""The modes flown with sticks: STABILIZE, ALT_HOLD, LOITER (and POSHOLD); and BRAKE and CIRCLE."""

from __future__ import annotations

import math
from functools import lru_cache

from simulator.airframe import MOTOR_MAX_N, WEIGHT_N
from simulator.behaviours import Behaviour
from simulator.flight_constants import TICK_S
from simulator.flight_state import FlightState
from simulator.geodesy import clamp
from simulator.orbit import Orbit
from simulator.position_control import TILT_LAG_S, Limits

PILOT_CLIMB_LAG_S = 0.4
"""Softness of the end of a climb or descent: 2.2 m after the stick is centred at 2.5 m/s (measured)."""
BRAKE_S = 5.5
"""Time that BRAKE needs to stop."""
BRAKE_LIMITS = Limits(1.0, 1.0, 1.0, 7.5, 2.5)
_limits = lru_cache(maxsize=64)(Limits)
"""The same ones in each tick, while nobody writes a parameter."""


class Stabilize(Behaviour):
    """Lean angles from the sticks, thrust directly from the throttle; the middle is about hover."""

    def run(self) -> None:
        flight = self.flight
        throttle = flight.sticks.throttle
        if flight.landed and throttle <= 0.0:
            flight.rest()
            return
        turn_with_stick(self)
        middle = max(flight.sticks.throttle_mid, 1.0)
        if throttle <= middle:
            thrust_n = WEIGHT_N * throttle / middle
        else:
            thrust_n = WEIGHT_N + (4 * MOTOR_MAX_N - WEIGHT_N) * (throttle - middle) / (1000.0 - middle)
        flight.target.reset(flight.body)
        flight.fly_by_thrust(lean_of_sticks(self), thrust_n)
        if not flight.body.on_ground:
            flight.landed = False


class AltHold(Behaviour):
    """Holds the height but not the position: the wind carries the vehicle away."""

    def run(self) -> None:
        flight = self.flight
        if not climb_with_stick(self):
            return
        turn_with_stick(self)
        flight.fly(lean_of_sticks(self))


class Loiter(Behaviour):
    """Sticks move the target; when they are centred, target and vehicle stop."""

    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self._take_off_m: float | None = None

    @property
    def waits_to_take_off(self) -> bool:
        return self._take_off_m is not None

    def enter(self) -> None:
        self._take_off_m = None

    def take_off(self, alt_over_home_m: float) -> bool:
        self._take_off_m = alt_over_home_m + self.flight.home_local()[2]
        self.flight.lift_off()
        return True

    def run(self) -> None:
        flight, target = self.flight, self.flight.target
        if self._take_off_m is not None:
            target.climb_to(self._take_off_m, flight.limits(), TICK_S)
            if flight.sticks.climb_mps > 0.0 or abs(flight.body.alt_m - self._take_off_m) < 0.1:
                self._take_off_m = None
        elif not climb_with_stick(self):
            return
        turn_with_stick(self)
        parameters = flight.parameters
        speed = clamp(parameters["LOIT_SPEED"] / 100.0, 0.2, 50.0)
        roll, pitch, _ = sticks_flown(flight)
        forward, right = -pitch * speed, roll * speed
        pushing = forward != 0.0 or right != 0.0
        accel = parameters["LOIT_ACC_MAX"] / 100.0 if pushing else parameters["LOIT_BRK_ACCEL"] / 100.0
        yaw = flight.body.attitude()[2]
        cos, sin = math.cos(yaw), math.sin(yaw)
        limits = _limits(speed, 2.5, 2.5, accel)
        target.fly_with(forward * cos - right * sin, forward * sin + right * cos, limits, TICK_S)
        flight.fly()


class Brake(Behaviour):
    """Stops and holds position, without sticks. Takes the same time from any speed, and fades out softly (measured)."""

    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self._from = (0.0, 0.0)
        self._since_s = 0.0

    def enter(self) -> None:
        self._from = (self.flight.body.vn_mps, self.flight.body.ve_mps)
        self._since_s = self.flight.now_s

    def run(self) -> None:
        flight = self.flight
        if flight.landed:
            flight.rest()
            return
        flight.target.climb_with(0.0, BRAKE_LIMITS, TICK_S, PILOT_CLIMB_LAG_S)
        # The target lags by the time of leaning over; a vehicle that is level loses nothing by this.
        left = max(1.0 - (flight.now_s - self._since_s + TILT_LAG_S) / BRAKE_S, 0.0) ** 2
        flight.target.fly_with(self._from[0] * left, self._from[1] * left, BRAKE_LIMITS, TICK_S)
        flight.fly()


class Circle(Behaviour):
    """Circles a centre CIRCLE_RADIUS ahead of where the mode was entered, nose inwards."""

    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self._orbit = Orbit((0.0, 0.0), 1.0, 0.0)

    def enter(self) -> None:
        body = self.flight.body
        yaw, radius_m = body.attitude()[2], max(self.flight.parameters["CIRCLE_RADIUS"] / 100.0, 1.0)
        centre = (body.north_m + radius_m * math.cos(yaw), body.east_m + radius_m * math.sin(yaw))
        self._orbit = Orbit(centre, radius_m, yaw + math.pi)

    def run(self) -> None:
        flight = self.flight
        if climb_with_stick(self):
            self._orbit.run(flight, math.radians(flight.parameters["CIRCLE_RATE"]))
            flight.fly()


def lean_of_sticks(behaviour: Behaviour) -> tuple[float, float]:
    """Returns roll and pitch, radians; both sticks together lean no farther than one. Level in a radio failsafe."""
    flight = behaviour.flight
    roll, pitch, _ = sticks_flown(flight)
    size = math.hypot(roll, pitch)
    most = flight.lean_max_rad() / max(size, 1.0)
    return roll * most, pitch * most


def sticks_flown(flight: FlightState) -> tuple[float, float, float]:
    """Returns roll, pitch and yaw, -1..1: centred in a radio failsafe, whatever the last input."""
    if flight.failsafes.radio:
        return 0.0, 0.0, 0.0
    return flight.sticks.roll, flight.sticks.pitch, flight.sticks.yaw


def turn_with_stick(behaviour: Behaviour) -> None:
    flight = behaviour.flight
    rate = math.radians(clamp(flight.parameters["PILOT_Y_RATE"], 0.0, 90.0))
    flight.attitude.turn(sticks_flown(flight)[2] * rate, TICK_S)


def climb_with_stick(behaviour: Behaviour) -> bool:
    """Moves the target's height with the throttle; False while the vehicle rests on the ground."""
    flight = behaviour.flight
    climb = 0.0 if flight.failsafes.radio else clamp(flight.sticks.climb_mps, -20.0, 20.0)
    if flight.landed:
        if climb <= 0.0:
            flight.rest()
            return False
        flight.lift_off()
    limits = _limits(1.0, 1.0, 1.0, 2.5, flight.parameters["PILOT_ACCEL_Z"] / 100.0)
    flight.target.climb_with(climb, limits, TICK_S, PILOT_CLIMB_LAG_S)
    if flight.body.on_ground:
        flight.target.alt_m = max(flight.target.alt_m, flight.body.alt_m - 0.5)
    return True
