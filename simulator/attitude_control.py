"""From a wanted attitude and thrust to four motor commands: angle, rate and mixing."""

from __future__ import annotations

import math

from simulator.airframe import ARM_M, INERTIA_XY, INERTIA_Z, MOTOR_MAX_N, YAW_TORQUE_M, Airframe, Commands
from simulator.geodesy import clamp, wrap_pi

ANGLE_P = 6.0
RATE_P = 14.0
RATE_I = 10.0
RATE_I_MAX = 25.0
YAW_ANGLE_P = 3.0
YAW_RATE_P = 4.0
RATE_MAX_RPS = math.radians(220.0)
YAW_RATE_MAX_RPS = math.radians(90.0)
LEAN_SMOOTHING_S = 0.12
"""Time constant that smooths the lean requests of pilots and of the position controller, as ATC_INPUT_TC does."""
IDLE_COMMAND = 0.06
"""Armed motors never stop in flight (MOT_SPIN_ARM)."""


class AttitudeControl:
    def __init__(self) -> None:
        self.yaw_target_rad = 0.0
        self._roll_rad = 0.0
        self._pitch_rad = 0.0
        self._integral = (0.0, 0.0, 0.0)

    def reset(self, yaw_rad: float) -> None:
        self.yaw_target_rad = yaw_rad
        self._roll_rad = self._pitch_rad = 0.0
        self._integral = (0.0, 0.0, 0.0)

    def turn(self, rate_rps: float, dt_s: float) -> None:
        """Moves the wanted heading: a pilot's yaw stick."""
        self.yaw_target_rad = wrap_pi(self.yaw_target_rad + rate_rps * dt_s)

    def turn_towards(self, yaw_rad: float, rate_rps: float, dt_s: float) -> None:
        error = wrap_pi(yaw_rad - self.yaw_target_rad)
        step = rate_rps * dt_s
        self.yaw_target_rad = wrap_pi(self.yaw_target_rad + clamp(error, -step, step))

    def commands(self, body: Airframe, lean: tuple[float, float], thrust_n: float, dt_s: float) -> Commands:
        """`lean`: roll and pitch in radians. `thrust_n`: total thrust of all motors."""
        blend = dt_s / (LEAN_SMOOTHING_S + dt_s)
        self._roll_rad += (lean[0] - self._roll_rad) * blend
        self._pitch_rad += (lean[1] - self._pitch_rad) * blend
        error_x, error_y, error_z = self._error(body)
        rate_x = clamp(ANGLE_P * error_x, -RATE_MAX_RPS, RATE_MAX_RPS)
        rate_y = clamp(ANGLE_P * error_y, -RATE_MAX_RPS, RATE_MAX_RPS)
        rate_z = clamp(YAW_ANGLE_P * error_z, -YAW_RATE_MAX_RPS, YAW_RATE_MAX_RPS)
        off_x, off_y, off_z = rate_x - body.p_rps, rate_y - body.q_rps, rate_z - body.r_rps
        kept_x, kept_y, kept_z = self._integral
        kept_x = clamp(kept_x + RATE_I * off_x * dt_s, -RATE_I_MAX, RATE_I_MAX)
        kept_y = clamp(kept_y + RATE_I * off_y * dt_s, -RATE_I_MAX, RATE_I_MAX)
        kept_z = clamp(kept_z + RATE_I * off_z * dt_s, -RATE_I_MAX, RATE_I_MAX)
        self._integral = (kept_x, kept_y, kept_z)
        turn_x, turn_y, turn_z = RATE_P * off_x + kept_x, RATE_P * off_y + kept_y, YAW_RATE_P * off_z + kept_z
        return mix(thrust_n, turn_x * INERTIA_XY, turn_y * INERTIA_XY, turn_z * INERTIA_Z)

    def lean_error_rad(self, body: Airframe) -> float:
        """Returns how wrongly the vehicle leans, whatever its heading."""
        error_x, error_y, _ = self._error(body)
        return math.hypot(error_x, error_y)

    def _error(self, body: Airframe) -> tuple[float, float, float]:
        """Returns the remaining rotation, as an axis in the body frame times an angle."""
        cr, sr = math.cos(self._roll_rad / 2), math.sin(self._roll_rad / 2)
        cp, sp = math.cos(self._pitch_rad / 2), math.sin(self._pitch_rad / 2)
        cy, sy = math.cos(self.yaw_target_rad / 2), math.sin(self.yaw_target_rad / 2)
        tw = cr * cp * cy + sr * sp * sy
        tx = sr * cp * cy - cr * sp * sy
        ty = cr * sp * cy + sr * cp * sy
        tz = cr * cp * sy - sr * sp * cy
        w, x, y, z = body.qw, -body.qx, -body.qy, -body.qz
        ew = w * tw - x * tx - y * ty - z * tz
        sign = 2.0 if ew >= 0.0 else -2.0
        ex = w * tx + x * tw + y * tz - z * ty
        ey = w * ty - x * tz + y * tw + z * tx
        ez = w * tz + x * ty - y * tx + z * tw
        return sign * ex, sign * ey, sign * ez


def mix(thrust_n: float, roll_nm: float, pitch_nm: float, yaw_nm: float) -> Commands:
    """Roll and pitch have priority over thrust, and thrust over yaw: a vehicle that cannot stay level falls."""
    full = 4.0 * MOTOR_MAX_N
    level = clamp(thrust_n / full, IDLE_COMMAND, 1.0)
    roll = clamp(roll_nm / (ARM_M * full), -0.35, 0.35)
    pitch = clamp(pitch_nm / (ARM_M * full), -0.35, 0.35)
    tilt = (-roll + pitch, roll - pitch, roll + pitch, -roll - pitch)
    spread = max(tilt)  # tilt is symmetric: the lowest motor is at -spread
    level = clamp(level, min(spread + IDLE_COMMAND * 0.5, 0.5), max(1.0 - spread, 0.5))
    room = max(0.0, min(level - spread, 1.0 - level - spread))
    yaw = clamp(yaw_nm / (YAW_TORQUE_M * full), -room, room)
    motors = (level + tilt[0] + yaw, level + tilt[1] + yaw, level + tilt[2] - yaw, level + tilt[3] - yaw)
    if min(motors) >= 0.0 and max(motors) <= 1.0:
        return motors
    m1, m2, m3, m4 = motors
    return clamp(m1, 0.0, 1.0), clamp(m2, 0.0, 1.0), clamp(m3, 0.0, 1.0), clamp(m4, 0.0, 1.0)
