"""The commander of one vehicle of `tower-sim`: it stands above the arming and the modes of ArduCopter or PX4.

Whatever their own checks say, only the commander arms. It sees what the vehicle knows of itself, never the truth.
"""

from __future__ import annotations

import math

from simulator.firmware.commander import Commander, RequestRefused
from simulator.firmware.health import (
    BLOWN_M,
    BLOWN_S,
    FAR_M,
    FLAT_V,
    LOW_V,
    MAX_LEAN_ERROR_RAD,
    MOTOR_FAILED_S,
    VOLTAGE_S,
    Fault,
)
from simulator.firmware.states import SystemState
from simulator.flight_state import FlightState
from simulator.notices import Notice

PERIOD_S = 0.1
RADIO_SILENT_S = 1.0
TRAILS_S = 0.3
"""A vehicle may be so far behind its target, which moves ahead of it: 2.1 m were seen at 10 m/s in still air."""
MUTE_AFTER_S = 3.5
"""Heartbeats come once a second: three are missing."""


class FlightCommander:
    def __init__(self) -> None:
        self._commander = Commander()
        self._due_s = 0.0
        self._volts = math.inf
        self._leans_wrong_s = 0.0
        self._away_s = 0.0
        self._far_s = 0.0

    @property
    def state(self) -> SystemState:
        return self._commander.state

    @property
    def faults(self) -> tuple[Fault, ...]:
        """As of the last check."""
        return self._commander.faults

    # Requests. Each returns the reason of a refusal, or None.

    def arm(self, flight: FlightState, *, manual: bool) -> str | None:
        self._leans_wrong_s = 0.0
        self._look(flight)
        reason = self.change(manual=manual)
        return f"Arm: {reason}" if reason else None

    def change(self, *, manual: bool) -> str | None:
        """`manual`: sticks fly in the mode that is wanted."""
        try:
            if manual:
                self._commander.run_manual()
            else:
                self._commander.auto()
        except RequestRefused as error:
            return str(error)
        return None

    def stop(self) -> None:
        self._commander.stop()

    # Time.

    def update(self, flight: FlightState) -> list[Notice]:
        """Called each tick. Returns what is to be told."""
        if flight.now_s >= self._due_s - 1e-9:
            self._due_s = flight.now_s + PERIOD_S
            self._measure(flight)
            self._look(flight)
            self._commander.update(flight.now_s)
        if not self._commander.texts:
            return []
        told = list(self._commander.texts)
        self._commander.texts.clear()
        return told

    def _measure(self, flight: FlightState) -> None:
        volts = flight.battery.voltage_v
        self._volts = volts if self._volts == math.inf else self._volts + (volts - self._volts) * PERIOD_S / VOLTAGE_S
        flying = flight.armed and not flight.landed and not flight.body.on_ground
        wrong = flying and flight.attitude.lean_error_rad(flight.body) > MAX_LEAN_ERROR_RAD
        if self._leans_wrong_s < MOTOR_FAILED_S:  # a motor that failed stays failed until the next arming
            self._leans_wrong_s = self._leans_wrong_s + PERIOD_S if wrong else 0.0
        target, body = flight.target, flight.body
        apart_m = math.hypot(target.north_m - body.north_m, target.east_m - body.east_m)
        near_m = BLOWN_M + TRAILS_S * math.hypot(target.vn_mps, target.ve_mps)
        away = flying and flight.estimator.position_ok and apart_m > near_m
        self._away_s = self._away_s + PERIOD_S if away else 0.0
        self._far_s = self._far_s + PERIOD_S if away and apart_m > near_m - BLOWN_M + FAR_M else 0.0

    def _look(self, flight: FlightState) -> None:
        """Sets the flags. Those of tasks and outputs stay: software alone cannot lose them."""
        health, heard_s = self._commander.health, flight.heartbeat_heard_s
        contradictions = flight.body.contradictions()
        health.attitude_known = flight.estimator.attitude_ok
        health.position_known = flight.estimator.position_ok
        health.gps_fix = flight.estimator.gps_fix
        health.gps_believed = "GPS glitch" not in contradictions
        health.compass_believed = "Compass inconsistent" not in contradictions
        health.heading_known = "Heading doubtful" not in contradictions
        health.barometer_moving = "Barometer stuck" not in contradictions
        health.vibration_low = "Vibration high" not in contradictions
        health.battery_volts_ok = self._volts > LOW_V
        health.battery_flat = self._volts < FLAT_V or flight.battery.left <= 0.0
        health.motors = self._leans_wrong_s < MOTOR_FAILED_S
        health.in_place = self._away_s < BLOWN_S
        health.far_away = self._far_s >= BLOWN_S
        health.radio = flight.sticks.silent_for_s(flight.now_s) <= RADIO_SILENT_S
        health.mavlink_required = heard_s is not None
        health.mavlink_in = heard_s is None or flight.now_s - heard_s <= MUTE_AFTER_S
