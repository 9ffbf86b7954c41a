"""The quadrotor as a rigid body: four motors with lag, thrust, drag, gravity and the ground.

World axes are north, east, down (metres); body axes are forward, right, down. The ground is flat at down = 0, unless
`ground` says where it is. This module knows neither flight modes nor MAVLink: motor commands in, motion out.
"""

from __future__ import annotations

import math
from collections.abc import Set
from dataclasses import dataclass

from simulator.failure_modes import Failure
from simulator.terrain import Ground

GRAVITY_MSS = 9.80665
MASS_KG = 1.5
MOTOR_MAX_N = 8.2
"""Each motor at full command and full battery: a thrust-to-weight ratio of 2.2."""
MOTOR_LAG_S = 0.03
ARM_M = 0.177
"""Distance of each motor from the roll and the pitch axis (an X frame)."""
YAW_TORQUE_M = 0.016
"""Newton metres of reaction torque per newton of thrust."""
INERTIA_XY = 0.020
INERTIA_Z = 0.036
DRAG_LINEAR = 0.25
DRAG_QUADRATIC = 0.030
"""Measured: 10.2 m/s at full lean; 1.6 m/s of that remain five seconds and 23 m after levelling."""
ROTATION_DRAG = 0.4
FRICTION = 0.6
"""Of the landing gear on grass."""
HILLSIDE_SLOPE = 0.1
"""Who flies against steeper ground hits it with the whole speed."""

STEADY_INNOVATIONS = (0.02, 0.02, 0.02, 0.02)

WEIGHT_N = MASS_KG * GRAVITY_MSS
HOVER_COMMAND = WEIGHT_N / (4.0 * MOTOR_MAX_N)


def drag_of(speed_mps: float) -> float:
    """Returns the share of its airspeed that the vehicle loses per second."""
    return DRAG_LINEAR + DRAG_QUADRATIC * speed_mps


def impact_mps(ground: Ground | None, place_m: tuple[float, float], velocity_mps: tuple[float, float, float]) -> float:
    """Returns the speed at which a vehicle hits the ground: at `place_m`, north and east, with north, east and down."""
    north, east, down = velocity_mps
    speed = math.hypot(north, east)
    if ground is None or speed < 0.1:
        return down
    # One metre farther on.
    slope = ground(place_m[0] + north / speed, place_m[1] + east / speed) - ground(*place_m)
    return math.hypot(speed, down) if slope > HILLSIDE_SLOPE else down + slope * speed


def euler_rad(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Returns roll, pitch and yaw of a quaternion."""
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw


@dataclass(frozen=True, slots=True)
class GpsQuality:
    """What a receiver with a fix says of itself; `fix` and the accuracies as GPS_RAW_INT has them."""

    fix: int
    satellites: int
    horizontal_m: float
    vertical_m: float
    speed_mps: float


EXACT_GPS = GpsQuality(6, 10, 0.3, 0.3, 0.04)
"""As ArduCopter's own simulator."""

Commands = tuple[float, float, float, float]
"""Motors 1 to 4 in ArduPilot's numbering (front right, rear left, front left, rear right), 0..1."""


class Airframe:
    """Position and motion of the vehicle; `step` advances it by `dt_s`."""

    def __init__(self, yaw_rad: float = 0.0) -> None:
        self.north_m = self.east_m = self.down_m = 0.0
        self.vn_mps = self.ve_mps = self.vd_mps = 0.0
        self.qw, self.qx, self.qy, self.qz = math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2)
        self.p_rps = self.q_rps = self.r_rps = 0.0
        self.thrust_n = [0.0, 0.0, 0.0, 0.0]
        self.motor_health = [1.0, 1.0, 1.0, 1.0]
        self.on_ground = True
        self.impact_mps = 0.0
        self.force_body_mss = (0.0, 0.0, -GRAVITY_MSS)
        """The reading of an accelerometer."""
        self.ground: Ground | None = None
        """None: flat."""
        self._roll_pitch_yaw = (0.0, 0.0, yaw_rad)

    @property
    def alt_m(self) -> float:
        return 0.0 - self.down_m

    def attitude(self) -> tuple[float, float, float]:
        """Roll, pitch and yaw, radians."""
        return self._roll_pitch_yaw

    @property
    def true_pose(self) -> tuple[float, float, float, tuple[float, float, float, float]]:
        """North, east, height and quaternion, whatever the vehicle believes: what a camera sees."""
        return self.north_m, self.east_m, self.alt_m, (self.qw, self.qx, self.qy, self.qz)

    def suffer(self, failures: Set[Failure]) -> None:
        """Called each tick with the failures at work. This body knows the truth: no sensor can fail."""

    def gps_quality(self) -> GpsQuality:
        return EXACT_GPS

    def contradictions(self) -> tuple[str, ...]:
        """What is wrong with its sensors, as the vehicle notices it: texts for the ground station."""
        return ()

    def innovations(self) -> tuple[float, float, float, float]:
        """Of velocity, horizontal position, height and compass, as shares of what the filter still believes."""
        return STEADY_INNOVATIONS

    def ground_m(self) -> float:
        """Returns the height of the ground below, over the origin."""
        return 0.0 if self.ground is None else self.ground(self.north_m, self.east_m)

    def ground_speed_mps(self) -> float:
        return math.hypot(self.vn_mps, self.ve_mps)

    def stand_where(self, other: Airframe) -> None:
        """Stands at rest, at the place and heading of another one that was there before."""
        self.north_m, self.east_m, self.down_m = other.north_m, other.east_m, other.down_m
        self.turn_to(other.attitude()[2])

    def turn_to(self, yaw_rad: float) -> None:
        """Levels the vehicle with this heading."""
        self.qw, self.qx, self.qy, self.qz = math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2)
        self._roll_pitch_yaw = (0.0, 0.0, yaw_rad)

    def step(self, commands: Commands, dt_s: float, wind_mps: tuple[float, float, float], power: float) -> None:
        """`power`: share of the full thrust that remains at the present battery voltage, 0..1."""
        blend = dt_s / (MOTOR_LAG_S + dt_s)
        thrust, health = self.thrust_n, self.motor_health
        full_n = MOTOR_MAX_N * power
        for i in range(4):
            thrust[i] += (commands[i] * full_n * health[i] - thrust[i]) * blend
        f1, f2, f3, f4 = thrust
        total_n = f1 + f2 + f3 + f4
        if self.on_ground and total_n < 0.2 * WEIGHT_N and self.vn_mps == 0.0 and self.ve_mps == 0.0:
            return  # parked: nothing can move
        self._rotate(ARM_M * (f2 + f3 - f1 - f4), ARM_M * (f1 + f3 - f2 - f4), f1 + f2 - f3 - f4, dt_s)
        self._translate(total_n, dt_s, wind_mps)
        self._touch_ground(total_n, dt_s)
        self._roll_pitch_yaw = self._euler()

    def _rotate(self, roll_nm: float, pitch_nm: float, yaw_n: float, dt_s: float) -> None:
        p, q, r = self.p_rps, self.q_rps, self.r_rps
        gyroscopic = (INERTIA_Z - INERTIA_XY) / INERTIA_XY
        p += (roll_nm / INERTIA_XY - gyroscopic * q * r - ROTATION_DRAG * p) * dt_s
        q += (pitch_nm / INERTIA_XY + gyroscopic * p * r - ROTATION_DRAG * q) * dt_s
        r += (yaw_n * YAW_TORQUE_M / INERTIA_Z - ROTATION_DRAG * r) * dt_s
        self.p_rps, self.q_rps, self.r_rps = p, q, r
        w, x, y, z = self.qw, self.qx, self.qy, self.qz
        h = 0.5 * dt_s
        nw = w - h * (x * p + y * q + z * r)
        nx = x + h * (w * p + y * r - z * q)
        ny = y + h * (w * q + z * p - x * r)
        nz = z + h * (w * r + x * q - y * p)
        k = 1.0 / math.sqrt(nw * nw + nx * nx + ny * ny + nz * nz)
        self.qw, self.qx, self.qy, self.qz = nw * k, nx * k, ny * k, nz * k

    def _translate(self, total_n: float, dt_s: float, wind_mps: tuple[float, float, float]) -> None:
        w, x, y, z = self.qw, self.qx, self.qy, self.qz
        lift = total_n / MASS_KG
        vn, ve, vd = self.vn_mps - wind_mps[0], self.ve_mps - wind_mps[1], self.vd_mps - wind_mps[2]
        drag = drag_of(math.sqrt(vn * vn + ve * ve + vd * vd))
        an = -2.0 * (x * z + w * y) * lift - drag * vn
        ae = -2.0 * (y * z - w * x) * lift - drag * ve
        ad = -(1.0 - 2.0 * (x * x + y * y)) * lift - drag * vd + GRAVITY_MSS
        self.force_body_mss = (-drag * vn, -drag * ve, -lift)
        self.vn_mps += an * dt_s
        self.ve_mps += ae * dt_s
        self.vd_mps += ad * dt_s
        self.north_m += self.vn_mps * dt_s
        self.east_m += self.ve_mps * dt_s
        self.down_m += self.vd_mps * dt_s

    def _touch_ground(self, total_n: float, dt_s: float) -> None:
        floor_m = 0.0 if self.ground is None else -self.ground(self.north_m, self.east_m)
        if self.down_m < floor_m:
            self.on_ground = False
            return
        if not self.on_ground:
            self.impact_mps = impact_mps(
                self.ground, (self.north_m, self.east_m), (self.vn_mps, self.ve_mps, self.vd_mps)
            )
        self.on_ground = True
        self.down_m = floor_m
        self.vd_mps = min(self.vd_mps, 0.0)
        grip = 0.8 if total_n < WEIGHT_N else 0.95
        self.vn_mps *= grip
        self.ve_mps *= grip
        speed = math.hypot(self.vn_mps, self.ve_mps)
        friction = FRICTION * max(GRAVITY_MSS - total_n / MASS_KG, 0.0) * dt_s
        if speed < max(0.01, friction):
            self.vn_mps = self.ve_mps = 0.0
        else:  # without it the wind would push a landed vehicle along
            self.vn_mps -= self.vn_mps / speed * friction
            self.ve_mps -= self.ve_mps / speed * friction
        # The landing gear stands level: only the heading survives the touchdown.
        self.p_rps = self.q_rps = self.r_rps = 0.0
        self.turn_to(self._euler()[2])
        self.force_body_mss = (0.0, 0.0, -GRAVITY_MSS)

    def _euler(self) -> tuple[float, float, float]:
        return euler_rad(self.qw, self.qx, self.qy, self.qz)
