"""Physics, sensors and filters of several vehicles, advanced together: NumPy takes for one nearly as long as for many.

Each vehicle hands in what its motors are told. When all have, the step is flown, and each is shown what its own filter
believes. Time begins when the group is made; a vehicle that restarts stands where it is and aligns its filter again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Protocol

import numpy as np

from simulator.airframe import MOTOR_MAX_N, Commands
from simulator.estimation.error_state import FirstDoubts
from simulator.estimation.fusion import GATE_SIGMAS, Flags
from simulator.estimation.navigation_filter import NavigationFilter
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
ALIGN_SHARE = 0.3
"""Of the boot time."""
SETTLING_S = 2.0
"""After the start, until every sensor has been heard."""
JUDGED_EVERY_S = 0.1
"""Contradictions between sensors and filter last for a second before they count."""
MAX_INNOVATION = 10.0
WARM_BAROMETER_M = 0.25
"""What a restart leaves of the barometer's error: the place of the restart is not where it read zero."""
CONTRADICTIONS = ("GPS glitch", "Compass inconsistent", "Heading doubtful", "Barometer stuck", "Vibration high")


class Member(Protocol):
    """A vehicle of the group."""

    def show(self, row: list[float], *, on_ground: bool, aligned: bool) -> None:
        """`row`: thrusts and specific force in truth, then belief: position, velocity, attitude, rates, roll, pitch,
        yaw."""

    def hit(self, north_m: float, east_m: float, velocity_mps: tuple[float, float, float]) -> None:
        """Touched the ground, there and so fast (north, east, down)."""


class SensingGroup:
    def __init__(self, members: Sequence[Member], yaws_rad: Sequence[float], seed: int, boot_s: float) -> None:
        count = len(members)
        self.count = count
        self.members = list(members)
        self.truth = Quadrotors(DESIGN, count, np.array(yaws_rad))
        self.board = SensorBoard(count, seed, warm_start=True)
        self.board.gps.slow.error_m[:] = 0.0  # the origin is where the first fix says it is
        compass, left = self.board.magnetometer, np.random.default_rng((seed, 101)).standard_normal((2, 3, count))
        compass.calibration = MagnetometerCalibration(
            compass.hard_iron_gauss + 0.004 * left[0], compass.soft_iron * (1.0 + 0.006 * left[1])
        )
        self.filter = NavigationFilter(count)
        self.monitor = Monitor(count)
        self.contradictions: list[tuple[str, ...]] = [()] * count
        """Of each vehicle: texts for the ground station."""
        self.now_s = 0.0
        self.aligned = np.zeros(count, dtype=np.bool_)
        self._share = MOTOR_MAX_N / DESIGN.full_thrust_n
        self._align_s = min(MAX_ALIGN_S, ALIGN_SHARE * boot_s)
        self._since_s = np.zeros(count)
        """The last switch-on."""
        self._no_fix_s = np.zeros(count)
        """The last time without a fix: only later positions can contradict."""
        self._judge_due_s = 0.0
        self._sums: list[Floats] = [np.zeros((3, count)) for _ in range(3)]
        self._samples = np.zeros((2, count))
        """Of the inertial sensors and of the compass."""
        self._handed_in = 0
        self._waits = [True] * count
        self._commands: list[Commands] = [(0.0, 0.0, 0.0, 0.0)] * count
        self._wind_mps: list[tuple[float, float, float]] = [(0.0, 0.0, 0.0)] * count
        self._power = [1.0] * count

    def hand_in(
        self, seat: int, commands: Commands, dt_s: float, wind_mps: tuple[float, float, float], power: float
    ) -> None:
        """Of the vehicle at this place in the group; the last one flies the step. Raises RuntimeError for a second
        time within a step: the vehicles of a group are stepped in turn."""
        if not self._waits[seat]:
            raise RuntimeError("a vehicle of the group was stepped twice, and another one not at all")
        self._waits[seat] = False
        self._commands[seat], self._wind_mps[seat], self._power[seat] = commands, wind_mps, power
        self._handed_in += 1
        if self._handed_in == self.count:
            self._handed_in = 0
            self._waits = [True] * self.count
            self._advance(dt_s)

    def restart(self, seat: int) -> None:
        """Stands level and at rest, and knows nothing but where it is."""
        truth = self.truth
        upright = level(1, float(to_euler(truth.attitude[:, seat : seat + 1])[2, 0]))
        truth.attitude[:, seat], truth.rotation[:, :, seat] = upright[:, 0], matrix(upright)[:, :, 0]
        for motion in (truth.velocity_mps, truth.rates_rps, truth.rotor_rps, truth.thrust_n):
            motion[:, seat] = 0.0
        truth.impact_mps[seat], truth.on_ground[seat], truth.motor_health[:, seat] = 0.0, True, 1.0
        self._since_s[seat] = self._no_fix_s[seat] = self.now_s
        self.aligned[seat] = False
        self.contradictions[seat] = ()
        for gathered in (*self._sums, self._samples):
            gathered[:, seat] = 0.0

    def innovations(self, seat: int) -> tuple[float, float, float, float]:
        fused = self.filter.fused
        kinds = ("velocity", "gps", "barometer", "compass")
        velocity, gps, height, compass = (
            min(float(fused[kind].worst[seat]) / GATE_SIGMAS, MAX_INNOVATION) if kind in fused else 0.0
            for kind in kinds
        )
        return velocity, gps, height, compass

    # A step.

    def _advance(self, dt_s: float) -> None:
        """Commands are shares of full thrust; speed controllers take the share of full speed, its root."""
        truth, board = self.truth, self.board
        commands = np.array(self._commands).T
        speed = np.sqrt(np.maximum(commands * self._share, 0.0))
        truth.step(speed, dt_s, np.array(self._wind_mps).T, np.array(self._power))
        self.now_s += dt_s
        self._no_fix_s = np.where(board.gps.fix < Fix.FIX_3D, self.now_s, self._no_fix_s)
        readings = board.read(truth, self.now_s, dt_s)
        self.monitor.watch(readings, dt_s)
        self.filter.barometer_trusted = self.monitor.barometer_moving
        self.filter.compass_moving = self.monitor.compass_moving
        self.filter.inertial_moving = np.asarray(self.monitor.inertial_moving.all(axis=0))
        if self.filter.aligned:
            self.filter.step(readings, dt_s, truth.on_ground & ~commands.any(axis=0))
        if not self.aligned.all():
            self._gather(readings)
        if self.now_s >= self._judge_due_s - 1e-9:
            self._judge_due_s = self.now_s + JUDGED_EVERY_S
            self._judge()
        self._show(readings)

    def _gather(self, readings: Readings) -> None:
        """Standing still, whose mean starts the filters."""
        self._sums[0] += readings.acceleration_mss
        self._sums[1] += readings.rates_rps
        self._samples[0] += 1.0
        if readings.magnetometer is not None:
            self._sums[2] += readings.magnetometer.value
            self._samples[1] += 1.0
        stood = (self.now_s >= self._since_s + self._align_s) & (self._samples[1] > 0.0) & ~self.aligned
        if not stood.any():
            return
        seats = np.flatnonzero(stood)
        many, fields = self._samples[:, seats]
        force, rates, field = (sums[:, seats] for sums in self._sums)
        # The shorter the rest, the less is known of the gyroscope's bias.
        gyro_bias_rps = math.radians(0.06 + 0.4 / math.sqrt(many.min()))
        doubts = FirstDoubts(gyro_bias_rps=gyro_bias_rps, tilt_rad=0.012, position_m=0.2)
        if self.filter.aligned:
            doubts = replace(doubts, barometer_m=WARM_BAROMETER_M)
        self.filter.align(force / many, rates / many, field / fields, doubts, seats, self.truth.position_m[:, seats])
        self.aligned[seats] = True

    def _judge(self) -> None:
        navigation, believed_s = self.filter, self.now_s - DISBELIEVED_S
        watched = self.aligned & (self.now_s >= self._since_s + self._align_s + SETTLING_S)
        heard_s = np.maximum(navigation.gps_accepted_s, self._no_fix_s)
        wrong: Flags = watched & np.array(
            [
                (heard_s < believed_s) & navigation.position_ok,
                navigation.compass_accepted_s < believed_s,
                ~navigation.heading.known,
                ~self.monitor.barometer_moving,
                self.monitor.vibration_mss > MAX_VIBRATION_MSS,
            ]
        )
        self.contradictions = [()] * self.count
        for seat in np.flatnonzero(wrong.any(axis=0)):
            self.contradictions[seat] = tuple(
                text for text, found in zip(CONTRADICTIONS, wrong[:, seat], strict=True) if found
            )

    def _show(self, readings: Readings) -> None:
        truth, state = self.truth, self.filter.state
        parts = (
            truth.thrust_n,
            readings.acceleration_mss,
            state.position_m,
            state.velocity_mps,
            state.attitude,
            self.filter.rates_rps,
            to_euler(state.attitude),
        )
        rows = np.concatenate(parts).T.tolist()
        on_ground, aligned = truth.on_ground.tolist(), self.aligned.tolist()
        for member, row, grounded, known in zip(self.members, rows, on_ground, aligned, strict=True):
            member.show(row, on_ground=grounded, aligned=known)
        for seat in np.flatnonzero(truth.impact_mps):
            north_m, east_m, _ = truth.position_m[:, seat].tolist()
            north, east, _ = truth.velocity_mps[:, seat].tolist()
            self.members[seat].hit(north_m, east_m, (north, east, float(truth.impact_mps[seat])))
