"""The flight modes of PX4: the numbers in HEARTBEAT.custom_mode, and the class that flies each."""

from __future__ import annotations

import math
from enum import IntEnum

from simulator.auto import Auto
from simulator.behaviours import Behaviour
from simulator.flight_constants import TICK_S
from simulator.flight_state import FlightState
from simulator.guided import Guided, TakeOff
from simulator.homing import Land, ReturnToLaunch
from simulator.modes import ModeRules
from simulator.orbit import Orbit
from simulator.piloted import AltHold, Loiter, Stabilize


def custom_mode(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


class Px4Mode(IntEnum):
    MANUAL = custom_mode(1)
    ALTCTL = custom_mode(2)
    POSCTL = custom_mode(3)
    ORBIT = custom_mode(3, 1)
    TAKEOFF = custom_mode(4, 2)
    LOITER = custom_mode(4, 3)
    """Shown as Hold."""
    MISSION = custom_mode(4, 4)
    RTL = custom_mode(4, 5)
    LAND = custom_mode(4, 6)
    OFFBOARD = custom_mode(6)
    STABILIZED = custom_mode(7)


RULES: dict[IntEnum, ModeRules] = {
    Px4Mode.MANUAL: ModeRules(False, True, manual_throttle=True, pilot_controlled=True),
    Px4Mode.STABILIZED: ModeRules(False, True, manual_throttle=True, pilot_controlled=True),
    Px4Mode.ALTCTL: ModeRules(False, True, pilot_controlled=True),
    Px4Mode.POSCTL: ModeRules(True, True, pilot_controlled=True),
    Px4Mode.ORBIT: ModeRules(True, False, counts_as_guided=True),
    Px4Mode.TAKEOFF: ModeRules(True, True, counts_as_guided=True),
    Px4Mode.LOITER: ModeRules(True, True, counts_as_guided=True),
    Px4Mode.MISSION: ModeRules(True, True, counts_as_guided=True),
    Px4Mode.RTL: ModeRules(True, False, counts_as_guided=True),
    Px4Mode.LAND: ModeRules(False, False, counts_as_guided=True),
    Px4Mode.OFFBOARD: ModeRules(True, True, takes_setpoints=True),
}

STICK_MODES = frozenset(mode for mode, rules in RULES.items() if rules.pilot_controlled)


def mode_of(number: int) -> Px4Mode | None:
    try:
        return Px4Mode(number)
    except ValueError:
        return None


class TakingOff(Guided):
    """AUTO.TAKEOFF: climbs as soon as it is armed, and changes to AUTO.LOITER at the top."""

    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self.alt_over_origin_m: float | None = None
        """None: MIS_TAKEOFF_ALT above home."""

    @property
    def waits_to_take_off(self) -> bool:
        return True

    def run(self) -> None:
        flight = self.flight
        if flight.landed and self.goal is None:
            alt_m = self.alt_over_origin_m
            if alt_m is None:
                alt_m = flight.home_local()[2] + flight.parameters["MIS_TAKEOFF_ALT"]
            self.take_off(alt_m - flight.home_local()[2])
        super().run()
        if not isinstance(self.goal, TakeOff) and not flight.landed:
            self.alt_over_origin_m = None
            flight.set_mode(Px4Mode.LOITER)


class Orbiting(Behaviour):
    """Orbits the position of DO_ORBIT; without one it holds position."""

    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self._orbit: Orbit | None = None
        self._rate_rps = 0.0
        self._alt_m = 0.0

    def go_round(self, centre: tuple[float, float], radius_m: float, speed_mps: float, alt_m: float) -> None:
        """`centre`: relative to the origin. `radius_m`: negative is counter-clockwise. Begins on the vehicle's side."""
        body = self.flight.body
        angle = math.atan2(body.east_m - centre[1], body.north_m - centre[0])
        self._orbit = Orbit(centre, abs(radius_m), angle)
        self._rate_rps = speed_mps / self._orbit.radius_m * (1 if radius_m > 0 else -1)
        self._alt_m = alt_m

    def run(self) -> None:
        flight = self.flight
        if flight.landed:
            flight.rest()
            return
        limits = flight.limits()
        if self._orbit is None:
            flight.target.climb_with(0.0, limits, TICK_S)
            flight.target.fly_with(0.0, 0.0, limits, TICK_S)
        else:
            flight.target.climb_to(self._alt_m, limits, TICK_S)
            self._orbit.run(flight, self._rate_rps)
        flight.fly()


def make_behaviours(flight: FlightState) -> dict[IntEnum, Behaviour]:
    return {
        Px4Mode.MANUAL: Stabilize(flight),
        Px4Mode.STABILIZED: Stabilize(flight),
        Px4Mode.ALTCTL: AltHold(flight),
        Px4Mode.POSCTL: Loiter(flight),
        Px4Mode.ORBIT: Orbiting(flight),
        Px4Mode.TAKEOFF: TakingOff(flight),
        Px4Mode.LOITER: Guided(flight),
        Px4Mode.MISSION: Auto(flight),
        Px4Mode.RTL: ReturnToLaunch(flight),
        Px4Mode.LAND: Land(flight),
        Px4Mode.OFFBOARD: Guided(flight),
    }
