"""Watches sensors, filter and motion, and turns what it sees into the commander's flags. Many vehicles at once."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from simulator.estimation.error_state import ATTITUDE
from simulator.firmware.health import (
    BLOWN_M,
    BLOWN_S,
    FAR_M,
    FLAT_V,
    LOW_V,
    MAX_LEAN_ERROR_RAD,
    MOTOR_FAILED_S,
    VOLTAGE_S,
    Health,
    Sensor,
)
from simulator.firmware.watched import Watched
from simulator.physics.rotation import Floats, conjugate, limited, multiply, to_vector
from simulator.sensors.board import Readings
from simulator.sensors.satellites import Fix

Flags = npt.NDArray[np.bool_]

VIBRATION_S = 1.0
MAX_VIBRATION_MSS = 1.0
MAX_KNOCK_MSS = 6.0
"""A touchdown is not a vibration: no sample counts for more."""
STUCK_AFTER_READINGS = 25
"""Noise never repeats itself so often."""
DEAD_AFTER_READINGS = 10
"""Of an inertial sensor: without it a vehicle flies for a moment only."""
DISBELIEVED_S = 1.0
MAX_TILT_DOUBT_RAD = math.radians(10.0)


class Monitor:
    def __init__(self, count: int) -> None:
        self.radio = np.ones(count, dtype=np.bool_)
        self.mavlink_in = np.ones(count, dtype=np.bool_)
        self.mavlink_out = np.ones(count, dtype=np.bool_)
        self.mavlink_required = np.zeros(count, dtype=np.bool_)
        """The four are set from outside: by links, or by faults."""
        self.compass_calibrated = np.ones(count, dtype=np.bool_)
        self._flags: dict[str, Flags] = {}
        self._present: dict[Sensor, Flags] = {}
        self._mean_mss = np.zeros((3, count))
        self._mean_mss[2] = -9.8
        self._vibration = np.zeros(count)
        self._barometer_m = np.zeros(count)
        self._repeated = np.zeros(count)
        self._inertial = np.zeros((2, 3, count))
        self._inertial_repeated = np.zeros((2, count))
        self._field = np.zeros((3, count))
        self._field_repeated = np.zeros(count)
        self._far_s = np.zeros(count)
        self._volts = np.full(count, 4.2 * 4)
        self._leans_wrong_s = np.zeros(count)
        self._away_s = np.zeros(count)
        self._dt_s = 0.0
        self._no_fix_s = np.full(count, -math.inf)
        """The last time without a fix: only later positions can contradict."""

    @property
    def barometer_moving(self) -> Flags:
        return np.asarray(self._repeated < STUCK_AFTER_READINGS)

    @property
    def compass_moving(self) -> Flags:
        return np.asarray(self._field_repeated < STUCK_AFTER_READINGS)

    @property
    def inertial_moving(self) -> Flags:
        """Of the accelerometers and of the gyroscopes, (2, vehicles)."""
        return np.asarray(self._inertial_repeated < DEAD_AFTER_READINGS)

    @property
    def vibration_mss(self) -> Floats:
        return np.sqrt(self._vibration)

    def watch(self, readings: Readings, dt_s: float) -> None:
        """Called each step."""
        self._dt_s += dt_s
        blend = dt_s / VIBRATION_S
        inertial = np.stack((readings.acceleration_mss, readings.rates_rps))
        dead = ~np.isfinite(inertial).all(axis=1) | (inertial == self._inertial).all(axis=1)
        self._inertial_repeated, self._inertial = np.where(dead, self._inertial_repeated + 1.0, 0.0), inertial
        felt = np.where(np.isfinite(readings.acceleration_mss), readings.acceleration_mss, self._mean_mss)
        off = limited(felt - self._mean_mss, -MAX_KNOCK_MSS, MAX_KNOCK_MSS)
        self._mean_mss += 5.0 * blend * off
        self._vibration += blend * (np.einsum("in,in->n", off, off) / 3.0 - self._vibration)
        if readings.barometer is not None:
            same = (readings.barometer.value == self._barometer_m) | ~np.isfinite(readings.barometer.value)
            self._repeated = np.where(same, self._repeated + 1.0, 0.0)
            self._barometer_m = readings.barometer.value
        if readings.magnetometer is not None:
            field = readings.magnetometer.value
            same = (field == self._field).all(axis=0) | ~np.isfinite(field).all(axis=0)
            self._field_repeated, self._field = np.where(same, self._field_repeated + 1.0, 0.0), field

    def judge(self, machine: Watched) -> None:
        """Called some ten times a second, before the flags are told."""
        board, navigation, now_s = machine.board, machine.filter, machine.now_s
        over_s, self._dt_s = self._dt_s, 0.0
        self._volts += (board.batteries.read()[0] - self._volts) * min(over_s / VOLTAGE_S, 1.0)
        flying = machine.armed & ~machine.landed
        aligned = np.full(machine.count, navigation.aligned)
        fix = board.gps.fix >= Fix.FIX_3D
        self._no_fix_s = np.where(fix, self._no_fix_s, now_s)
        gps_heard_s = np.maximum(navigation.gps_accepted_s, self._no_fix_s)
        self._flags = {
            "radio": self.radio,
            "mavlink_in": self.mavlink_in,
            "mavlink_out": self.mavlink_out,
            "mavlink_required": self.mavlink_required,
            "attitude_known": aligned & (navigation.state.spread(ATTITUDE)[:2].max(axis=0) < MAX_TILT_DOUBT_RAD),
            "position_known": aligned & navigation.position_ok,
            "gps_fix": fix,
            "gps_believed": ~aligned | (now_s - gps_heard_s < DISBELIEVED_S) | ~navigation.position_ok,
            "compass_believed": ~aligned | (now_s - navigation.compass_accepted_s < DISBELIEVED_S),
            "heading_known": ~aligned | ~self.compass_calibrated | navigation.heading.known,
            "barometer_moving": self.barometer_moving,
            "vibration_low": self.vibration_mss < MAX_VIBRATION_MSS,
            "battery_volts_ok": self._volts > LOW_V,
            "battery_flat": self._volts < FLAT_V,
            "motors": self._motors_ok(machine, flying, over_s),
            "in_place": self._in_place(machine, flying, over_s),
        }
        self._flags["far_away"] = self._far_s >= BLOWN_S
        accelerometer_moving, gyroscope_moving = self.inertial_moving
        everything = np.ones(machine.count, dtype=np.bool_)
        self._present = {
            Sensor.COMPASS: board.magnetometer.present,
            Sensor.BAROMETER: board.barometer.present,
            Sensor.GPS: board.gps.present,
            Sensor.ACCELEROMETER: accelerometer_moving,
            Sensor.GYROSCOPE: gyroscope_moving,
        }
        self._present |= {sensor: everything for sensor in Sensor if sensor not in self._present}

    def tell(self, vehicle: int, health: Health) -> None:
        for name, flags in self._flags.items():
            setattr(health, name, bool(flags[vehicle]))
        health.present = frozenset(sensor for sensor, flags in self._present.items() if flags[vehicle])
        health.calibrated = frozenset(Sensor) - (set() if self.compass_calibrated[vehicle] else {Sensor.COMPASS})

    def _motors_ok(self, machine: Watched, flying: Flags, over_s: float) -> Flags:
        """A vehicle that does not lean as it is told for a while has lost a motor."""
        error = to_vector(multiply(conjugate(machine.filter.state.attitude), machine.cascade.wanted_attitude))
        wrong = flying & (np.hypot(error[0], error[1]) > MAX_LEAN_ERROR_RAD)
        self._leans_wrong_s = np.where(wrong, self._leans_wrong_s + over_s, 0.0)
        return np.asarray(self._leans_wrong_s < MOTOR_FAILED_S)

    def _in_place(self, machine: Watched, flying: Flags, over_s: float) -> Flags:
        if machine.reference is None:
            return np.ones(machine.count, dtype=np.bool_)
        place = machine.reference.position_m
        place = place[:, np.newaxis] if place.ndim == 1 else place
        apart = place[:2] - machine.filter.state.position_m[:2]
        apart_m = np.hypot(apart[0], apart[1])
        self._far_s = np.where(flying & (apart_m > FAR_M), self._far_s + over_s, 0.0)
        away = flying & (apart_m > BLOWN_M)
        self._away_s = np.where(away, self._away_s + over_s, 0.0)
        return np.asarray(self._away_s < BLOWN_S)
