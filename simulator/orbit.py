"""Circles a centre at a given radius, with the nose pointing inwards."""

from __future__ import annotations

import math

from simulator.flight_constants import TICK_S
from simulator.flight_state import FlightState
from simulator.geodesy import clamp

TURN_RATE_RPS = math.radians(60.0)
ON_IT_M = 2.0
"""Turns count once the vehicle is this close to the point that it follows."""


class Orbit:
    def __init__(self, centre: tuple[float, float], radius_m: float, angle_rad: float) -> None:
        """Begins at `angle_rad`, seen from the centre."""
        self.centre = centre
        self.radius_m = clamp(radius_m, 1.0, 2000.0)
        self.angle_rad = angle_rad
        self.turned_rad = 0.0
        self._begun = False

    def run(self, flight: FlightState, rate_rps: float) -> None:
        """Flies one tick; positive is clockwise. The limits of speed and acceleration apply. The caller controls the
        height and calls `flight.fly`."""
        limits, body = flight.limits(), flight.body
        if self._begun:
            fastest = min(limits.speed_mps, math.sqrt(limits.acceleration_mss * self.radius_m)) / self.radius_m
            step = clamp(rate_rps, -fastest, fastest) * TICK_S
            self.angle_rad += step
            self.turned_rad += abs(step)
        north_m = self.centre[0] + self.radius_m * math.cos(self.angle_rad)
        east_m = self.centre[1] + self.radius_m * math.sin(self.angle_rad)
        self._begun |= math.hypot(north_m - body.north_m, east_m - body.east_m) < ON_IT_M
        flight.target.fly_to(north_m, east_m, limits, body, TICK_S)
        if flight.roi is None:
            flight.attitude.turn_towards(self.angle_rad + math.pi, TURN_RATE_RPS, TICK_S)
        else:
            look_at_roi(flight)


def look_at_roi(flight: FlightState) -> bool:
    """Turns towards the region of interest; False if there is none, or it is directly below."""
    if flight.roi is None:
        return False
    gap_n, gap_e = flight.roi[0] - flight.body.north_m, flight.roi[1] - flight.body.east_m
    if math.hypot(gap_n, gap_e) < 1.0:
        return False
    flight.attitude.turn_towards(math.atan2(gap_e, gap_n), TURN_RATE_RPS, TICK_S)
    return True
