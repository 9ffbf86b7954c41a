"""The navigation filter: inertial sensors carry the belief on, compass, barometer and satellites correct it.

`align` starts it on the ground; `step` is called with each step's readings. Measurements are late; they are compared
with what the filter believed when they were taken.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from simulator.estimation.error_state import ATTITUDE, ErrorState, FilterNoise, FirstDoubts, Indices
from simulator.estimation.fusion import Component, Flags, Fused, fuse
from simulator.estimation.heading_check import HeadingCheck
from simulator.physics.rigid_body import GRAVITY_MSS
from simulator.physics.rotation import Floats, from_euler, from_vector, matrix, multiply, normalised, to_body, to_world
from simulator.sensors.board import Readings
from simulator.sensors.magnetometer import earth_field_gauss
from simulator.sensors.sampling import Reading

COVARIANCE_S = 0.04
MAX_HISTORY_S = 0.3
GPS_DISBELIEVED_S = 7.0
"""After satellites have contradicted the filter for so long, it is the filter that is wrong."""
COMPASS_DISBELIEVED_S = 10.0
CHANGED_YAW_RAD, CHANGED_GYRO_RPS = 0.15, math.radians(4.0)
"""How unsure the filter becomes of heading and gyroscope, when the gyroscope must have changed."""
CHANGED_TILT_RAD, CHANGED_ACCELERATION_MSS, CHANGED_TURN_RPS = math.radians(2.0), 0.3, math.radians(1.0)
MISFIT, MISFIT_S, CHANGED_EVERY_S = 4.0, 2.0, 3.0
"""Velocities by satellites that are so unlike what the inertial sensors say, over so long, show that these have
changed. 1 is as expected."""
AIDED_S = 6.0
"""A position counts for so long after the last accepted one."""
STANDING_MPS = 0.03
START_M, START_MPS = 0.3, 0.2
"""Of a position and velocity taken over from satellites: their noise, and the way of a delay."""


@dataclass(frozen=True, slots=True)
class Believed:
    """What the filter believed at an earlier step."""

    at_s: float
    position_m: Floats
    velocity_mps: Floats
    rotation: Floats
    corrected: Floats
    """The sum of all corrections of velocity and position until then, (6, vehicles)."""


class NavigationFilter:
    def __init__(self, count: int, noise: FilterNoise | None = None) -> None:
        self.state = ErrorState(count, noise or FilterNoise())
        self.aligned = False
        self.fused: dict[str, Fused] = {}
        """The last measurement of each kind: `gps`, `velocity`, `compass`, `barometer`."""
        self.rates_rps = np.zeros((3, count))
        """Without bias."""
        self.acceleration_mss = np.zeros((3, count))
        """Of the vehicle, in world axes, without gravity."""
        self.gps_accepted_s = np.full(count, -math.inf)
        self.compass_accepted_s = np.full(count, -math.inf)
        self.barometer_accepted_s = np.full(count, -math.inf)
        self.heading = HeadingCheck(count)
        self.compass_moving = np.ones(count, dtype=np.bool_)
        """False: its readings are not used (a monitor found them stuck)."""
        self.inertial_moving: Flags = np.ones(count, dtype=np.bool_)
        """False: a monitor found the inertial sensors dead, and there is nothing to be learnt about them."""
        self._misfit = np.ones(count)
        self._changed_s = np.full(count, -math.inf)
        self.barometer_trusted = np.ones(count, dtype=np.bool_)
        """False: its readings are not used (a monitor found them stuck)."""
        self.compass_trusted = np.ones(count, dtype=np.bool_)
        """False while it is being calibrated."""
        self._field = earth_field_gauss()
        self._history: deque[Believed] = deque()
        self._corrected = np.zeros((6, count))
        self._felt_mss = np.zeros((3, count))
        self._turn = np.zeros((3, count))
        self._force = np.zeros((3, count))
        self._over_s = 0.0
        self._now_s = 0.0
        self._standing_due_s = 0.0

    @property
    def position_ok(self) -> Flags:
        return np.asarray(self._now_s - self.gps_accepted_s < AIDED_S)

    def align(
        self,
        acceleration_mss: Floats,
        rates_rps: Floats,
        field_gauss: Floats,
        doubts: FirstDoubts,
        which: Indices | None = None,
        position_m: Floats | None = None,
    ) -> None:
        """Starts from means over a second or more of standing still: attitude, and the bias of the gyroscope.

        `which`: the vehicles that start, all if None; every array has only theirs. `position_m`: where they stand, the
        origin if None. The others fly on."""
        state, seats = self.state, np.arange(self.state.count) if which is None else which
        ax, ay, az = acceleration_mss
        roll, pitch = np.arctan2(-ay, -az), np.arctan2(ax, np.hypot(ay, az))
        level = to_world(matrix(from_euler(roll, pitch, np.zeros_like(roll))), field_gauss)
        declination = math.atan2(self._field[1, 0], self._field[0, 0])
        attitude = from_euler(roll, pitch, declination - np.arctan2(level[1], level[0]))
        state.start(seats, attitude, np.zeros_like(rates_rps) if position_m is None else position_m, rates_rps)
        state.doubt(doubts, seats)
        for sums in (self._corrected, self._turn, self._force):
            sums[:, seats] = 0.0
        for then in self._history:  # what they believed before says nothing of now
            then.position_m[:, seats], then.velocity_mps[:, seats] = state.position_m[:, seats], 0.0
            then.rotation[:, :, seats], then.corrected[:, seats] = state.rotation[:, :, seats], 0.0
        self.gps_accepted_s[seats] = self.compass_accepted_s[seats] = self.barometer_accepted_s[seats] = -math.inf
        self.heading.start(seats, self._now_s)
        self._misfit[seats] = 1.0
        self.aligned = True

    def step(self, readings: Readings, dt_s: float, standing: Flags | None = None) -> None:
        """`standing`: vehicles known to stand still on the ground."""
        self._now_s = readings.now_s
        self._carry_on(readings, dt_s)
        if readings.barometer is not None:
            self._take_barometer(readings.barometer)
        if readings.magnetometer is not None:
            self._take_compass(readings.magnetometer)
        if readings.gps is not None:
            self._take_gps(readings.gps)
        if standing is not None and readings.now_s >= self._standing_due_s and standing.any():
            self._standing_due_s = readings.now_s + 0.2
            self._take_standing(standing)

    def _carry_on(self, readings: Readings, dt_s: float) -> None:
        state = self.state
        # A sensor that says what is no number has said nothing: the last of it counts on.
        rates = _finite(readings.rates_rps - state.gyro_bias_rps, self.rates_rps)
        self._felt_mss = _finite(readings.acceleration_mss, self._felt_mss)
        force = self._felt_mss - state.acceleration_bias_mss
        turn = rates * dt_s
        before = state.rotation
        state.attitude = normalised(multiply(state.attitude, from_vector(turn)))
        state.rotation = matrix(state.attitude)
        # The force acts at the attitude in the middle of the step.
        acceleration = to_world(0.5 * (before + state.rotation), force)
        acceleration[2] += GRAVITY_MSS
        state.position_m = state.position_m + state.velocity_mps * dt_s + (0.5 * dt_s * dt_s) * acceleration
        state.velocity_mps = state.velocity_mps + acceleration * dt_s
        self.rates_rps, self.acceleration_mss = rates, acceleration
        self._history.append(
            Believed(readings.now_s, state.position_m, state.velocity_mps, state.rotation, self._corrected)
        )
        while self._history[0].at_s < readings.now_s - MAX_HISTORY_S:
            self._history.popleft()
        self._turn += turn
        self._force += force * dt_s
        self._over_s += dt_s
        if self._over_s >= COVARIANCE_S - 1e-9:
            state.spread_out(self._turn, self._force / self._over_s, self._over_s, dt_s)
            self._turn, self._force, self._over_s = np.zeros_like(turn), np.zeros_like(turn), 0.0

    def _remember(self) -> None:
        state = self.state
        self._history.append(
            Believed(self._now_s, state.position_m, state.velocity_mps, state.rotation, self._corrected)
        )

    def _at(self, taken_s: float) -> Believed:
        """Returns what the filter now thinks of the time of a measurement: what it believed then, with all corrections
        since."""
        then = self._history[0]
        for believed in reversed(self._history):
            if believed.at_s <= taken_s + 1e-9:
                then = believed
                break
        since = self._corrected - then.corrected
        return Believed(
            then.at_s, then.position_m + since[3:], then.velocity_mps + since[:3], then.rotation, self._corrected
        )

    def _take(self, kind: str, components: list[Component], measured: Flags) -> Fused:
        error, fused = fuse(self.state.covariance, components, measured)
        self.state.inject(error)
        self._corrected = self._corrected + error.T[3:9]
        self.fused[kind] = fused
        return fused

    def _take_barometer(self, reading: Reading) -> None:
        then = self._at(reading.taken_s)
        innovation = reading.value + then.position_m[2] - self.state.barometer_bias_m
        late_s = self._now_s - reading.taken_s
        component = Component(innovation, ((8, -1.0), (5, late_s), (24, 1.0)), self.state.noise.barometer_m**2)
        fused = self._take("barometer", [component], reading.fresh & self.barometer_trusted)
        self.barometer_accepted_s = np.where(fused.accepted, self._now_s, self.barometer_accepted_s)

    def _take_compass(self, reading: Reading) -> None:
        state = self.state
        then = self._at(reading.taken_s)
        field = to_body(then.rotation, np.broadcast_to(self._field, reading.value.shape))
        innovation = reading.value - field - state.compass_bias_gauss
        x, y, z = field
        # d(field in body axes) / d(attitude) is the cross product matrix of that field.
        slopes = (((1, -z), (2, y)), ((0, z), (2, -x)), ((0, -y), (1, x)))
        variance = state.noise.compass_gauss**2
        components = [Component(innovation[axis], (*slopes[axis], (15 + axis, 1.0)), variance) for axis in range(3)]
        usable = reading.fresh & self.compass_trusted & self.compass_moving
        drifting = self.heading.take_compass(then.rotation, reading.value, usable, self._now_s)
        if drifting.any():
            self._doubt_gyroscope(drifting)
        fused = self._take("compass", components, usable)
        self.compass_accepted_s = np.where(fused.accepted, self._now_s, self.compass_accepted_s)
        lost = usable & (self._now_s - self.compass_accepted_s > COMPASS_DISBELIEVED_S)
        if lost.any() and self._now_s > COMPASS_DISBELIEVED_S:
            # Another field beside the sensor: learn it anew, and keep the heading from the gyroscope.
            for axis in range(15, 18):
                state.covariance[lost, axis, axis] += 0.3**2
            self.compass_accepted_s[lost] = self._now_s

    def _doubt_gyroscope(self, which: Flags) -> None:
        """The compass corrects the heading now, and finds the new bias."""
        state = self.state
        down = np.moveaxis(state.rotation, 2, 0)[which, 2, :]
        """The axis of yaw, in body axes."""
        state.covariance[which, ATTITUDE, ATTITUDE] += (
            CHANGED_YAW_RAD**2 * down[:, :, np.newaxis] * down[:, np.newaxis, :]
        )
        for axis in range(12, 15):
            state.covariance[which, axis, axis] += CHANGED_GYRO_RPS**2
        self.heading.forget_legs(which)

    def _watch_misfit(self, velocity: Fused) -> None:
        """Makes the filter unsure of inertial sensors that contradict the satellites for a while."""
        share = velocity.normalised / velocity.components
        over_s = 0.2 / MISFIT_S
        self._misfit = np.where(
            velocity.measured, self._misfit + over_s * (np.minimum(share, 50.0) - self._misfit), self._misfit
        )
        changed = (self._misfit > MISFIT) & self.inertial_moving & (self._now_s - self._changed_s > CHANGED_EVERY_S)
        if not changed.any():
            return
        self._changed_s[changed], self._misfit[changed] = self._now_s, 1.0
        spreads = [(0, CHANGED_TILT_RAD), (9, CHANGED_ACCELERATION_MSS), (12, CHANGED_TURN_RPS)]
        for first, spread in spreads:
            for axis in range(first, first + 3):
                self.state.covariance[changed, axis, axis] += spread**2

    def _take_gps(self, reading: Reading) -> None:
        state = self.state
        then = self._at(reading.taken_s)
        late_s = self._now_s - reading.taken_s
        position = reading.value[:3] - then.position_m - state.gps_bias_m - state.gps_multipath_m
        velocity = reading.value[3:] - then.velocity_mps
        noise = state.noise
        place = [
            Component(
                position[axis],
                ((6 + axis, 1.0), (3 + axis, -late_s), (18 + axis, 1.0), (21 + axis, 1.0)),
                noise.gps_m[axis] ** 2,
            )
            for axis in range(3)
        ]
        motion = [Component(velocity[axis], ((3 + axis, 1.0),), noise.gps_mps[axis] ** 2) for axis in range(3)]
        fused = self._take("gps", place, reading.fresh)
        seen = self._take("velocity", motion, reading.fresh)
        self.heading.take_velocity(
            then.velocity_mps[:2] - self._corrected[:2], reading.value[3:5], reading.fresh, self._now_s
        )
        self._watch_misfit(seen)
        self.gps_accepted_s = np.where(fused.accepted, self._now_s, self.gps_accepted_s)
        whole = reading.fresh & np.isfinite(reading.value).all(axis=0)
        lost = whole & (self._now_s - self.gps_accepted_s > GPS_DISBELIEVED_S)
        if lost.any() and self._now_s > GPS_DISBELIEVED_S:
            self._start_position_again(reading, lost)

    def _start_position_again(self, reading: Reading, lost: Flags) -> None:
        state = self.state
        state.position_m, state.velocity_mps = state.position_m.copy(), state.velocity_mps.copy()
        known_error_m = state.gps_bias_m + state.gps_multipath_m
        state.position_m[:2, lost] = (reading.value[:2] - known_error_m[:2])[:, lost]
        state.velocity_mps[:, lost] = reading.value[3:, lost]
        self.heading.forget_legs(lost)
        errors = [(18 + axis, 21 + axis) for axis in range(2)]
        for axis in (3, 4, 5, 6, 7, *errors[0], *errors[1]):
            variance = state.covariance[lost, axis, axis] if axis > 7 else START_MPS**2
            state.covariance[lost, axis, :] = 0.0
            state.covariance[lost, :, axis] = 0.0
            state.covariance[lost, axis, axis] = variance
        # The position is now the measured one: its error is that of the satellites with the other sign, and noise.
        for place, of_satellites in zip((6, 7), errors, strict=True):
            state.covariance[lost, place, place] = START_M**2
            for error in of_satellites:
                variance = state.covariance[lost, error, error]
                state.covariance[lost, place, place] += variance
                state.covariance[lost, place, error] = state.covariance[lost, error, place] = -variance
        self._history.clear()
        self._history.append(
            Believed(self._now_s, state.position_m, state.velocity_mps, state.rotation, self._corrected)
        )
        self.gps_accepted_s[lost] = self._now_s

    def _take_standing(self, standing: Flags) -> None:
        innovation = -self.state.velocity_mps
        components = [Component(innovation[axis], ((3 + axis, 1.0),), STANDING_MPS**2) for axis in range(3)]
        self._take("standing", components, standing)


def _finite(values: Floats, before: Floats) -> Floats:
    """Returns the values, and those of before where they are no numbers."""
    return np.asarray(np.where(np.isfinite(values), values, before))
