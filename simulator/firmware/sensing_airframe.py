"""One vehicle of `tower-sim` on physics, sensors and filter.

To modes, control and telemetry it is an `Airframe`; its position, motion and attitude are what the filter believes. The
truth is in `truth`; only the ground, the camera and tests look at it.
"""

from __future__ import annotations

import math
from collections.abc import Set
from typing import Final

import numpy as np

from simulator.airframe import MOTOR_MAX_N, Airframe, Commands, impact_mps
from simulator.estimation.error_state import FirstDoubts
from simulator.estimation.fusion import GATE_SIGMAS
from simulator.estimation.navigation_filter import NavigationFilter
from simulator.failure_modes import Failure
from simulator.firmware.faults import JUMP_GAUSS, JUMP_M, NOISE_FACTOR
from simulator.firmware.monitor import DISBELIEVED_S, MAX_VIBRATION_MSS, Monitor
from simulator.physics.quadrotor import Quadrotors
from simulator.physics.quadrotor_design import QuadrotorDesign
from simulator.physics.rotation import Floats, level, matrix, to_euler
from simulator.sensors.board import Readings, SensorBoard
from simulator.sensors.magnetometer_calibration import MagnetometerCalibration
from simulator.sensors.satellites import Fix

DESIGN: Final = QuadrotorDesign(motor_kg=0.105, arm_kg=0.08, core_kg=0.76)
"""Mass, inertia, thrust and drag of `simulator.airframe`, from dimensions."""
MAX_ALIGN_S = 2.0
SETTLING_S = 2.0
"""After the start, until every sensor has been heard."""
MAX_INNOVATION = 10.0
ALIGN_SHARE = 0.3
"""Of the boot time."""
_STANDING: Final = np.ones(1, dtype=np.bool_)
_FLYING: Final = np.zeros(1, dtype=np.bool_)


class SensingAirframe(Airframe):
    def __init__(self, yaw_rad: float, seed: int, boot_s: float) -> None:
        super().__init__(yaw_rad)
        self.truth = Quadrotors(DESIGN, 1, yaw_rad)
        self.board = SensorBoard(1, seed, warm_start=True)
        self.board.gps.slow.error_m[:] = 0.0  # the origin is where the first fix says it is
        compass, left = self.board.magnetometer, np.random.default_rng((seed, 101)).standard_normal((2, 3, 1))
        compass.calibration = MagnetometerCalibration(
            compass.hard_iron_gauss + 0.004 * left[0], compass.soft_iron * (1.0 + 0.006 * left[1])
        )
        self.filter = NavigationFilter(1)
        self.monitor = Monitor(1)
        self._share = MOTOR_MAX_N / DESIGN.full_thrust_n
        self._now_s = 0.0
        self._align_s = min(MAX_ALIGN_S, ALIGN_SHARE * boot_s)
        self._no_fix_s = 0.0
        """The last time without a fix: only later positions can contradict."""
        self._sums: list[Floats] = [np.zeros((3, 1)) for _ in range(3)]
        self._samples = [0, 0]

    def suffer(self, failures: Set[Failure]) -> None:
        board = self.board
        board.gps.lost[:] = Failure.GPS_LOST in failures
        board.gps.jump_m[:2] = JUMP_M if Failure.GPS_JUMP in failures else 0.0
        board.magnetometer.jump_gauss[1] = JUMP_GAUSS if Failure.COMPASS_JUMP in failures else 0.0
        noise = NOISE_FACTOR if Failure.IMU_NOISE in failures else 1.0
        board.accelerometer.noise_factor[:] = board.gyroscope.noise_factor[:] = noise
        board.barometer.stuck[:] = Failure.BARO_STUCK in failures

    def contradictions(self) -> tuple[str, ...]:
        navigation = self.filter
        if not navigation.aligned or self._now_s < self._align_s + SETTLING_S:
            return ()
        believed_s = self._now_s - DISBELIEVED_S
        heard_s = max(float(navigation.gps_accepted_s[0]), self._no_fix_s)
        gps = heard_s < believed_s
        found = (
            ("GPS glitch", gps and bool(navigation.position_ok[0])),
            ("Compass inconsistent", bool(navigation.compass_accepted_s[0] < believed_s)),
            ("Barometer stuck", not bool(self.monitor.barometer_moving[0])),
            ("Vibration high", bool(self.monitor.vibration_mss[0] > MAX_VIBRATION_MSS)),
        )
        return tuple(text for text, wrong in found if wrong)

    def innovations(self) -> tuple[float, float, float, float]:
        fused = self.filter.fused
        kinds = ("velocity", "gps", "barometer", "compass")
        velocity, gps, height, compass = (
            min(float(fused[kind].worst[0]) / GATE_SIGMAS, MAX_INNOVATION) if kind in fused else 0.0 for kind in kinds
        )
        return velocity, gps, height, compass

    @property
    def true_pose(self) -> tuple[float, float, float, tuple[float, float, float, float]]:
        position, q = self.truth.position_m[:, 0], self.truth.attitude[:, 0]
        quaternion = (float(q[0]), float(q[1]), float(q[2]), float(q[3]))
        return float(position[0]), float(position[1]), float(-position[2]), quaternion

    def ground_m(self) -> float:
        """In truth, as what a camera sees."""
        return float(-self.truth.floor_m[0])

    def stand_where(self, other: Airframe) -> None:
        super().stand_where(other)
        if not isinstance(other, SensingAirframe):
            raise TypeError("an airframe with sensors stands where one with sensors was")
        truth = self.truth
        truth.position_m[:] = other.truth.position_m
        truth.floor_m[:] = other.truth.floor_m
        truth.attitude = level(1, float(to_euler(other.truth.attitude)[2, 0]))
        truth.rotation = matrix(truth.attitude)
        self.filter.state.position_m = truth.position_m.copy()

    def step(self, commands: Commands, dt_s: float, wind_mps: tuple[float, float, float], power: float) -> None:
        """Commands are shares of full thrust; speed controllers take the share of full speed, its root."""
        truth = self.truth
        if self.ground is not None:
            truth.floor_m[0] = -self.ground(float(truth.position_m[0, 0]), float(truth.position_m[1, 0]))
        truth.motor_health[:, 0] = np.sqrt(self.motor_health)
        speed = np.sqrt(np.maximum(np.reshape(commands, (4, 1)) * self._share, 0.0))
        truth.step(speed, dt_s, np.reshape(wind_mps, (3, 1)), power)
        self._now_s += dt_s
        if self.board.gps.fix[0] < Fix.FIX_3D:
            self._no_fix_s = self._now_s
        readings = self.board.read(truth, self._now_s, dt_s)
        self.monitor.watch(readings, dt_s)
        self.filter.barometer_trusted = self.monitor.barometer_moving
        parked = not any(commands) and bool(truth.on_ground[0])
        if self.filter.aligned:
            self.filter.step(readings, dt_s, _STANDING if parked else _FLYING)
        else:
            self._gather(readings)
        self._show(readings)

    def _gather(self, readings: Readings) -> None:
        self._sums[0] += readings.acceleration_mss
        self._sums[1] += readings.rates_rps
        self._samples[0] += 1
        if readings.magnetometer is not None:
            self._sums[2] += readings.magnetometer.value
            self._samples[1] += 1
        if self._now_s >= self._align_s and self._samples[1]:
            force, rates, field = self._sums
            many = self._samples[0]
            # The shorter the rest, the less is known of the gyroscope's bias.
            doubts = FirstDoubts(
                gyro_bias_rps=math.radians(0.06 + 0.4 / math.sqrt(many)), tilt_rad=0.012, position_m=0.2
            )
            self.filter.align(force / many, rates / many, field / self._samples[1], doubts)

    def _show(self, readings: Readings) -> None:
        """Copies what the filter believes, and what touches the ground in truth."""
        truth, state = self.truth, self.filter.state
        self.thrust_n = truth.thrust_n[:, 0].tolist()
        self.on_ground = bool(truth.on_ground[0])
        if truth.impact_mps[0]:
            north_m, east_m, _ = truth.position_m[:, 0].tolist()
            north, east, _ = truth.velocity_mps[:, 0].tolist()
            hit = impact_mps(self.ground, (north_m, east_m), (north, east, float(truth.impact_mps[0])))
            self.impact_mps = max(self.impact_mps, hit)
        x, y, z = readings.acceleration_mss[:, 0].tolist()
        self.force_body_mss = (x, y, z)
        if not self.filter.aligned:
            return
        self.north_m, self.east_m, self.down_m = state.position_m[:, 0].tolist()
        self.vn_mps, self.ve_mps, self.vd_mps = state.velocity_mps[:, 0].tolist()
        self.qw, self.qx, self.qy, self.qz = state.attitude[:, 0].tolist()
        self.p_rps, self.q_rps, self.r_rps = self.filter.rates_rps[:, 0].tolist()
        self._roll_pitch_yaw = self._euler()
