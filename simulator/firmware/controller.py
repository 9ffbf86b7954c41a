"""Flight controllers of many vehicles: each step reads the sensors, runs the filter and flies the cascade.

One object is the whole machine: body, air, sensors, filter, control, one commander for each vehicle. Time is passed in
steps; nothing here has a clock, a socket or a source of chance but the seed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simulator.control.cascade import Cascade, Gains, Motion
from simulator.control.reference import Reference
from simulator.estimation.error_state import FirstDoubts
from simulator.estimation.navigation_filter import NavigationFilter
from simulator.firmware.commander import Commander
from simulator.firmware.monitor import Monitor
from simulator.firmware.states import SystemState
from simulator.physics.mixer import IDLE_SHARE
from simulator.physics.moving_air import MovingAir
from simulator.physics.quadrotor import Quadrotors
from simulator.physics.quadrotor_design import QuadrotorDesign
from simulator.physics.rotation import Floats, tilt_rad
from simulator.sensors.board import Readings, SensorBoard
from simulator.sensors.magnetometer_calibration import MagnetometerCalibration

DT_S = 0.005
COMMANDER_S = 0.1
ALIGN_S = 2.0
"""Standing still, whose mean starts the filter."""
DISARM_BELOW_M = 0.3
DISARM_AFTER_S = 1.0
"""A reference so far below a vehicle on the ground, for so long, is a landing that is over."""
EMERGENCY_DESCENT_MPS = 1.0
HARD_IMPACT_MPS = 5.0
MAX_STANDING_TILT_RAD = 1.0
CALIBRATION_LEFT_GAUSS = 0.004
CALIBRATION_LEFT_SHARE = 0.006
"""What a flown calibration leaves (standard deviations), for vehicles that come calibrated from the factory."""


@dataclass(frozen=True, slots=True)
class FleetSettings:
    count: int = 1
    seed: int = 1
    wind_mps: float = 0.0
    wind_from_deg: float = 0.0
    gust_share: float = 0.15
    dt_s: float = DT_S
    warm_start: bool = True
    """GPS has its fix at switch-on."""
    calibrated: bool = True
    battery_mah: float = 5200.0
    yaw_rad: float = 0.0


class Fleet:
    """`step` flies every armed vehicle along the reference it is given."""

    def __init__(
        self,
        settings: FleetSettings,
        design: QuadrotorDesign | None = None,
        gains: Gains | None = None,
        *,
        wind_learning: bool = True,
        body: Quadrotors | None = None,
    ) -> None:
        self.settings = settings
        self.count, self.dt_s = settings.count, settings.dt_s
        self.design = design or QuadrotorDesign()
        self.body = body or Quadrotors(self.design, self.count, settings.yaw_rad)
        self.air = MovingAir(
            self.count,
            np.random.default_rng((settings.seed, 100)),
            speed_mps=settings.wind_mps,
            from_deg=settings.wind_from_deg,
            gust_share=settings.gust_share,
        )
        self.board = SensorBoard(
            self.count, settings.seed, warm_start=settings.warm_start, battery_mah=settings.battery_mah
        )
        self._calibrated = settings.calibrated
        if settings.calibrated:
            self._come_calibrated(np.random.default_rng((settings.seed, 101)))
        self.filter = NavigationFilter(self.count)
        self.cascade = Cascade(self.design, self.count, gains, wind_learning=wind_learning)
        self.monitor = Monitor(self.count)
        self.commanders = [Commander() for _ in range(self.count)]
        self.now_s = 0.0
        self.commands = np.zeros((4, self.count))
        self.armed = np.zeros(self.count, dtype=np.bool_)
        self.landed = np.ones(self.count, dtype=np.bool_)
        self.reference: Reference | None = None
        self._idle = math.sqrt(IDLE_SHARE)
        self._down_s = np.zeros(self.count)
        self._commander_due_s = 0.0
        self._sums: list[Floats] = [np.zeros((3, self.count)) for _ in range(3)]
        self._samples = [0, 0]

    def _come_calibrated(self, random_source: np.random.Generator) -> None:
        compass = self.board.magnetometer
        left = random_source.standard_normal((2, 3, self.count))
        compass.calibration = MagnetometerCalibration(
            compass.hard_iron_gauss + CALIBRATION_LEFT_GAUSS * left[0],
            compass.soft_iron * (1.0 + CALIBRATION_LEFT_SHARE * left[1]),
        )

    # Requests.

    def boot(self, timeout_s: float = 30.0) -> None:
        """Stands until every commander is in SYS_SAFE and, unless it takes too long, every position is known."""
        end_s = self.now_s + timeout_s
        while self.now_s < end_s:
            self.step()
            if all(c.state is SystemState.SAFE and c.health.position_known for c in self.commanders):
                return

    def load_calibration(self, calibration: MagnetometerCalibration) -> None:
        """Before the start: of a flight that these vehicles flew earlier."""
        self.board.magnetometer.calibration = calibration
        self._calibrated = True

    def arm(self) -> None:
        """All of them, for automatic flight. Raises RequestRefused."""
        for commander in self.commanders:
            commander.auto()
        self._note_arming()

    def stop(self) -> None:
        for commander in self.commanders:
            commander.stop()
        self._note_arming()

    def motion(self) -> Motion:
        """As the filter knows it."""
        state = self.filter.state
        return Motion(state.position_m, state.velocity_mps, state.attitude, self.filter.rates_rps)

    # Time.

    def step(self, reference: Reference | None = None) -> None:
        """Without a reference the armed ones idle."""
        self.reference = reference
        self.commands = self._fly(reference)
        wind = self.air.step(self.now_s, self.dt_s)
        self.move(wind)
        self.now_s += self.dt_s
        readings = self.board.read(self.body, self.now_s, self.dt_s)
        self._estimate(readings)
        self.monitor.watch(readings, self.dt_s)
        self._notice_ground()
        if self.now_s >= self._commander_due_s - 1e-9:
            self._commander_due_s = self.now_s + COMMANDER_S
            self._command()

    def move(self, wind_mps: Floats) -> None:
        """The body's part of a step; another airframe has another."""
        self.body.step(self.commands, self.dt_s, wind_mps, self.board.batteries.power)

    def _fly(self, reference: Reference | None) -> Floats:
        if reference is None or not self.armed.any():
            return np.zeros((4, self.count))
        motion = self.motion()
        self.reference = reference = self._where_failed(reference, motion)
        commands = self.cascade.commands(motion, reference, self.dt_s, self.body.on_ground)
        return np.asarray(np.where(self.landed, self._idle, commands) * self.armed)

    def _where_failed(self, reference: Reference, motion: Motion) -> Reference:
        """A vehicle with a major fault sinks where it is."""
        failed = np.array([c.state is SystemState.FAIL_MAJOR for c in self.commanders])
        if not failed.any():
            return reference
        sinking = np.zeros((3, self.count))
        sinking[2] = EMERGENCY_DESCENT_MPS
        ahead = motion.position_m + np.array([[0.0], [0.0], [0.5]])
        return Reference(
            np.where(failed, ahead, _columns(reference.position_m)),
            np.where(failed, sinking, _columns(reference.velocity_mps)),
            np.where(failed, 0.0, _columns(reference.acceleration_mss)),
            reference.yaw_rad,
        )

    def _estimate(self, readings: Readings) -> None:
        if self.filter.aligned:
            self.filter.step(readings, self.dt_s, ~self.armed & self.landed)
            return
        self._sums[0] += readings.acceleration_mss
        self._sums[1] += readings.rates_rps
        self._samples[0] += 1
        if readings.magnetometer is not None:
            self._sums[2] += readings.magnetometer.value
            self._samples[1] += 1
        if self.now_s >= ALIGN_S and self._samples[1]:
            force, rates, field = self._sums
            doubts = FirstDoubts() if self._calibrated else UNCALIBRATED
            self.filter.align(force / self._samples[0], rates / self._samples[0], field / self._samples[1], doubts)

    def _notice_ground(self) -> None:
        """Landed: on the ground while the reference presses it there. That for a while, or a hard knock, stops the
        motors."""
        ended = self.armed & (self.body.impact_mps > HARD_IMPACT_MPS)
        if not self.body.on_ground.any():
            self.landed = self.body.on_ground
            return
        ended |= self.armed & self.body.on_ground & (tilt_rad(self.filter.state.attitude) > MAX_STANDING_TILT_RAD)
        pressed = np.ones(self.count, dtype=np.bool_)
        if self.reference is not None:
            place, speed = _columns(self.reference.position_m)[2], _columns(self.reference.velocity_mps)[2]
            pressed = (speed >= 0.0) & (place > self.filter.state.position_m[2] - 0.02)
            pressed_hard = place > self.filter.state.position_m[2] + DISARM_BELOW_M
            done = self.armed & self.body.on_ground & pressed_hard
            self._down_s = np.where(done, self._down_s + self.dt_s, 0.0)
        self.landed = self.body.on_ground & (pressed | ~self.armed)
        ended |= self._down_s > DISARM_AFTER_S
        for vehicle in np.flatnonzero(ended):
            self.commanders[vehicle].motors_stopped()
        if ended.any():
            self._note_arming()

    def _command(self) -> None:
        self.monitor.judge(self)
        self.filter.barometer_trusted = self.monitor.barometer_moving
        self.filter.compass_moving = self.monitor.compass_moving
        self.filter.inertial_moving = np.asarray(self.monitor.inertial_moving.all(axis=0))
        for vehicle, commander in enumerate(self.commanders):
            self.monitor.tell(vehicle, commander.health)
            commander.update(self.now_s)
            if commander.state is SystemState.FAIL_MAJOR and self.landed[vehicle]:
                commander.motors_stopped()
        self._note_arming()

    def _note_arming(self) -> None:
        armed = np.array([commander.health.armed for commander in self.commanders])
        fresh = armed & ~self.armed
        if fresh.any():
            self.cascade.reset(np.flatnonzero(fresh))
        self.armed = armed


UNCALIBRATED = FirstDoubts(yaw_rad=0.6, compass_bias_gauss=0.09)


def _columns(vector: Floats) -> Floats:
    return vector[:, np.newaxis] if vector.ndim == 1 else vector
