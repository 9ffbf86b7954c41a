"""Calibrations of PX4: a command starts one, and texts that begin with "[cal]" tell the rest (its documentation)."""

from __future__ import annotations

from typing import Final

from simulator.command_message import ACCEPTED, TEMPORARILY_REJECTED, Command
from simulator.flight_state import FlightState
from simulator.notices import Severity

_SENSORS: Final = {0: "gyro", 1: "mag", 2: "baro", 4: "accel"}
_STEPS: Final = (20, 50, 80)
STEP_S: Final = 0.5


def calibrate(flight: FlightState, command: Command) -> int:
    """All zero cancels."""
    if flight.armed:
        return TEMPORARILY_REJECTED
    params = command.raw if command.is_long else (*command.raw, 0.0, 0.0, 0.0)
    setup, now_s = flight.setup, flight.now_s
    sensor = next((name for at, name in _SENSORS.items() if params[at] == 1.0), "level" if params[4] == 2.0 else None)
    if sensor is None:
        if setup.texts:
            setup.texts.clear()
            flight.notify(Severity.INFO, "[cal] calibration cancelled")
        return ACCEPTED
    texts = [f"[cal] calibration started: 2 {sensor}"]
    texts += [f"[cal] progress <{percent}>" for percent in _STEPS]
    texts.append(f"[cal] calibration done: {sensor}")
    setup.texts = [(now_s + at * STEP_S, Severity.INFO, text) for at, text in enumerate(texts)]
    return ACCEPTED


def spin_motor(flight: FlightState, command: Command) -> int:
    """ACTUATOR_TEST."""
    del command
    return TEMPORARILY_REJECTED if flight.armed or not flight.landed else ACCEPTED
