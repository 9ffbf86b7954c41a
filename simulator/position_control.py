"""From a moving target to a lean angle and a thrust: position, velocity and acceleration loops."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from simulator.airframe import GRAVITY_MSS, MASS_KG, MOTOR_MAX_N, Airframe, drag_of
from simulator.geodesy import clamp

POSITION_P = 1.0
VELOCITY_P = 2.0
VELOCITY_I = 0.8
CLIMB_POSITION_P = 1.2
CLIMB_P = 5.0
CLIMB_I = 2.5
CLIMB_ACCELERATION_MAX = 5.0
TILT_LAG_S = 0.3
"""Time that the vehicle takes to lean over: the target's velocity follows its acceleration with this lag, while the
acceleration itself is flown at once, so that the two match and nothing overshoots."""
MIN_SLIDE_M = 1.0
"""A shorter leg is flown in height and to the side independently."""
LEASH_M = 4.0
"""A target farther ahead of the vehicle than this waits for it."""


_RANGES = (
    ("speed_mps", 0.2, 50.0),
    ("climb_mps", 0.1, 20.0),
    ("descent_mps", 0.1, 20.0),
    ("acceleration_mss", 0.5, 15.0),
    ("climb_acceleration_mss", 0.5, 10.0),
)


@dataclass(frozen=True, slots=True)
class Limits:
    """How fast a target may travel. Whatever the parameters, no faster than a quadrotor can follow."""

    speed_mps: float
    climb_mps: float
    descent_mps: float
    acceleration_mss: float = 2.5
    climb_acceleration_mss: float = 2.0

    def __post_init__(self) -> None:
        for name, low, high in _RANGES:
            object.__setattr__(self, name, clamp(getattr(self, name), low, high))


class Target:
    """The vehicle's wanted position at this instant, and the velocity of that position."""

    def __init__(self) -> None:
        self.north_m = self.east_m = self.alt_m = 0.0
        self.vn_mps = self.ve_mps = self.climb_mps = 0.0
        self.an_mss = self.ae_mss = 0.0
        self._vn_ahead = self._ve_ahead = self._climb_ahead = 0.0
        """The velocity that the target is about to have."""

    def reset(self, body: Airframe) -> None:
        """Starts from the vehicle's present motion, so that a mode change causes no jerk."""
        self.north_m, self.east_m, self.alt_m = body.north_m, body.east_m, body.alt_m
        self.vn_mps, self.ve_mps, self.climb_mps = body.vn_mps, body.ve_mps, -body.vd_mps
        self.an_mss = self.ae_mss = 0.0
        self._vn_ahead, self._ve_ahead, self._climb_ahead = self.vn_mps, self.ve_mps, self.climb_mps

    def fly_with(self, vn_mps: float, ve_mps: float, limits: Limits, dt_s: float) -> None:
        """Approaches a horizontal velocity within the acceleration limit."""
        dn, de = vn_mps - self._vn_ahead, ve_mps - self._ve_ahead
        change = math.hypot(dn, de)
        most = limits.acceleration_mss * dt_s
        share = 1.0 if change <= most else most / change
        self.an_mss, self.ae_mss = dn * share / dt_s, de * share / dt_s
        self._vn_ahead += dn * share
        self._ve_ahead += de * share
        blend = dt_s / (TILT_LAG_S + dt_s)
        self.vn_mps += (self._vn_ahead - self.vn_mps) * blend
        self.ve_mps += (self._ve_ahead - self.ve_mps) * blend
        self.north_m += self.vn_mps * dt_s
        self.east_m += self.ve_mps * dt_s

    def climb_with(self, climb_mps: float, limits: Limits, dt_s: float, lag_s: float = 0.0) -> None:
        """Approaches a climb rate; `lag_s` smooths the acceleration and delays it by that much."""
        most = limits.climb_acceleration_mss * dt_s
        self._climb_ahead += clamp(climb_mps - self._climb_ahead, -most, most)
        self.climb_mps += (self._climb_ahead - self.climb_mps) * dt_s / (lag_s + dt_s)
        self.alt_m += self.climb_mps * dt_s

    def fly_to(self, north_m: float, east_m: float, limits: Limits, body: Airframe, dt_s: float) -> None:
        """Travels straight to a position and stops there."""
        dn, de = north_m - self.north_m, east_m - self.east_m
        distance = math.hypot(dn, de)
        lag_m = math.hypot(self.north_m - body.north_m, self.east_m - body.east_m)
        speed = approach_speed(distance, limits.speed_mps, limits.acceleration_mss)
        speed *= clamp(2.0 * (1.0 - lag_m / LEASH_M), 0.0, 1.0)
        if distance < 1e-6:
            self.fly_with(0.0, 0.0, limits, dt_s)
        else:
            self.fly_with(dn / distance * speed, de / distance * speed, limits, dt_s)

    def slide_to(
        self,
        origin: tuple[float, float, float],
        to: tuple[float, float, float],
        limits: Limits,
        body: Airframe,
        dt_s: float,
    ) -> None:
        """Travels along the straight line in space between two points (north, east, height), as ArduCopter does: the
        slower of climb and flight sets the pace."""
        length_m = math.hypot(to[0] - origin[0], to[1] - origin[1])
        if length_m < MIN_SLIDE_M:
            self.climb_to(to[2], limits, dt_s)
            self.fly_to(to[0], to[1], limits, body, dt_s)
            return
        slope = (to[2] - origin[2]) / length_m
        fastest = limits.climb_mps if slope > 0.0 else limits.descent_mps
        pace = replace(limits, speed_mps=min(limits.speed_mps, fastest / abs(slope))) if slope else limits
        self.fly_to(to[0], to[1], pace, body, dt_s)
        to_go_m = math.hypot(to[0] - self.north_m, to[1] - self.east_m)
        gap_m = to[2] - slope * min(to_go_m, length_m) - self.alt_m
        ahead = slope * math.hypot(self._vn_ahead, self._ve_ahead) if to_go_m < length_m else 0.0
        catch_up = math.copysign(approach_speed(abs(gap_m), fastest, limits.climb_acceleration_mss), gap_m)
        self.climb_with(clamp(ahead + catch_up, -limits.descent_mps, limits.climb_mps), limits, dt_s)

    def climb_to(self, alt_m: float, limits: Limits, dt_s: float) -> None:
        gap = alt_m - self.alt_m
        fastest = limits.climb_mps if gap > 0.0 else limits.descent_mps
        speed = approach_speed(abs(gap), fastest, limits.climb_acceleration_mss)
        self.climb_with(math.copysign(speed, gap), limits, dt_s)


def approach_speed(distance_m: float, fastest_mps: float, braking_mss: float) -> float:
    """Returns the speed that still allows a stop in `distance_m`; linear close in, to avoid chatter."""
    braking = 0.7 * braking_mss
    linear_m = braking  # where the root and the straight line (1 m/s per metre) have the same slope
    if distance_m <= linear_m:
        return min(distance_m, fastest_mps)
    return min(math.sqrt(2.0 * braking * (distance_m - linear_m / 2.0)), fastest_mps)


class PositionControl:
    def __init__(self) -> None:
        self._push_n = self._push_e = 0.0
        self._lift = 0.0

    def reset(self) -> None:
        self._push_n = self._push_e = self._lift = 0.0

    def reset_horizontal(self) -> None:
        self._push_n = self._push_e = 0.0

    def thrust_n(self, body: Airframe, target: Target, dt_s: float) -> float:
        climb = target.climb_mps + clamp(CLIMB_POSITION_P * (target.alt_m - body.alt_m), -2.5, 2.5)
        error = climb + body.vd_mps
        self._lift = clamp(self._lift + CLIMB_I * error * dt_s, -4.0, 8.0)
        wanted = clamp(CLIMB_P * error, -CLIMB_ACCELERATION_MAX, CLIMB_ACCELERATION_MAX) + self._lift
        roll, pitch, _ = body.attitude()
        upright = max(math.cos(roll) * math.cos(pitch), 0.5)
        return clamp(MASS_KG * (GRAVITY_MSS + wanted) / upright, 0.0, 4.0 * MOTOR_MAX_N)

    def lean(self, body: Airframe, target: Target, lean_max_rad: float, dt_s: float) -> tuple[float, float]:
        """Returns roll and pitch, radians, that bring the vehicle to the target and hold it there in wind."""
        error_n = target.vn_mps - body.vn_mps + POSITION_P * clamp(target.north_m - body.north_m, -8.0, 8.0)
        error_e = target.ve_mps - body.ve_mps + POSITION_P * clamp(target.east_m - body.east_m, -8.0, 8.0)
        most = GRAVITY_MSS * math.tan(lean_max_rad)
        drag = drag_of(math.hypot(target.vn_mps, target.ve_mps))  # in still air; the loops learn the wind
        accel_n = target.an_mss + drag * target.vn_mps + VELOCITY_P * error_n + self._push_n
        accel_e = target.ae_mss + drag * target.ve_mps + VELOCITY_P * error_e + self._push_e
        size = math.hypot(accel_n, accel_e)
        if size > most:
            accel_n, accel_e = accel_n * most / size, accel_e * most / size
        else:  # learn the wind only while there is lean to spare, else the integrator winds up
            self._push_n += VELOCITY_I * error_n * dt_s
            self._push_e += VELOCITY_I * error_e * dt_s
        yaw = body.attitude()[2]
        cos, sin = math.cos(yaw), math.sin(yaw)
        forward, right = accel_n * cos + accel_e * sin, accel_e * cos - accel_n * sin
        pitch = -math.atan(forward / GRAVITY_MSS)
        return math.atan(right * math.cos(pitch) / GRAVITY_MSS), pitch
