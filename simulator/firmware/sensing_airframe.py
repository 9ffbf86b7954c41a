"""One vehicle of `tower-sim` on physics, sensors and filter.

To modes, control and telemetry it is an `Airframe`; its position, motion and attitude are what the filter believes. The
truth is in `group.truth`; only the ground, the camera and tests look at it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence, Set

import numpy as np

from simulator.airframe import Airframe, Commands, GpsQuality, impact_mps
from simulator.failure_modes import Failure
from simulator.firmware.faults import JUMP_GAUSS, JUMP_M, NOISE_FACTOR
from simulator.firmware.sensing_group import SensingGroup
from simulator.sensors.satellites import MULTIPATH_M, SATELLITES, SLOW_M, VELOCITY_NOISE_MPS, Fix

SENSED_GPS = GpsQuality(
    int(Fix.FIX_3D), SATELLITES, math.hypot(*SLOW_M[:2], *MULTIPATH_M[:2]), SLOW_M[2], VELOCITY_NOISE_MPS[0]
)


class SensingAirframe(Airframe):
    """Alone in its group, until `fly_together`."""

    def __init__(self, yaw_rad: float, seed: int, boot_s: float) -> None:
        super().__init__(yaw_rad)
        self.seed, self.boot_s = seed, boot_s
        self.group = SensingGroup([self], [yaw_rad], seed, boot_s)
        self.seat = 0
        self._told_health = list(self.motor_health)

    def suffer(self, failures: Set[Failure]) -> None:
        board, seat = self.group.board, self.seat
        board.gps.lost[seat] = Failure.GPS_LOST in failures
        board.gps.jump_m[:2, seat] = JUMP_M if Failure.GPS_JUMP in failures else 0.0
        board.magnetometer.jump_gauss[1, seat] = JUMP_GAUSS if Failure.COMPASS_JUMP in failures else 0.0
        noise = NOISE_FACTOR if Failure.IMU_NOISE in failures else 1.0
        board.accelerometer.noise_factor[seat] = board.gyroscope.noise_factor[seat] = noise
        board.barometer.stuck[seat] = Failure.BARO_STUCK in failures

    def gps_quality(self) -> GpsQuality:
        return SENSED_GPS

    def contradictions(self) -> tuple[str, ...]:
        return self.group.contradictions[self.seat]

    def innovations(self) -> tuple[float, float, float, float]:
        return self.group.innovations(self.seat)

    @property
    def true_pose(self) -> tuple[float, float, float, tuple[float, float, float, float]]:
        truth = self.group.truth
        north_m, east_m, down_m = truth.position_m[:, self.seat].tolist()
        w, x, y, z = truth.attitude[:, self.seat].tolist()
        return north_m, east_m, -down_m, (w, x, y, z)

    def ground_m(self) -> float:
        """In truth, as what a camera sees."""
        return 0.0 if self.ground is None else float(-self.group.truth.floor_m[self.seat])

    def stand_where(self, other: Airframe) -> None:
        """Takes the other's place in its group."""
        super().stand_where(other)
        if not isinstance(other, SensingAirframe):
            raise TypeError("an airframe with sensors stands where one with sensors was")
        self.group, self.seat = other.group, other.seat
        self.group.members[self.seat] = self
        self.group.restart(self.seat)

    def step(self, commands: Commands, dt_s: float, wind_mps: tuple[float, float, float], power: float) -> None:
        """In a group, what it sees of the step comes with the last vehicle's step."""
        truth, seat = self.group.truth, self.seat
        if self.ground is not None:
            truth.floor_m[seat] = -self.ground(float(truth.position_m[0, seat]), float(truth.position_m[1, seat]))
        if self.motor_health != self._told_health:
            self._told_health = list(self.motor_health)
            truth.motor_health[:, seat] = np.sqrt(self._told_health)
        self.group.hand_in(seat, commands, dt_s, wind_mps, power)

    def show(self, row: list[float], *, on_ground: bool, aligned: bool) -> None:
        self.thrust_n = row[:4]
        self.on_ground = on_ground
        self.force_body_mss = (row[4], row[5], row[6])
        if not aligned:
            return
        self.north_m, self.east_m, self.down_m, self.vn_mps, self.ve_mps, self.vd_mps = row[7:13]
        self.qw, self.qx, self.qy, self.qz, self.p_rps, self.q_rps, self.r_rps = row[13:20]
        self._roll_pitch_yaw = (row[20], row[21], row[22])

    def hit(self, north_m: float, east_m: float, velocity_mps: tuple[float, float, float]) -> None:
        self.impact_mps = max(self.impact_mps, impact_mps(self.ground, (north_m, east_m), velocity_mps))


def fly_together(airframes: Sequence[Airframe]) -> None:
    """Makes one group of airframes that have not been stepped yet; those without sensors stay as they are. Its noise
    follows from the seed of the first."""
    members = [one for one in airframes if isinstance(one, SensingAirframe)]
    if len(members) > 1:
        first = members[0]
        group = SensingGroup(members, [one.attitude()[2] for one in members], first.seed, first.boot_s)
        for seat, one in enumerate(members):
            one.group, one.seat = group, seat
