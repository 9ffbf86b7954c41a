"""What the commands of calibrations and motor tests do, as ArduCopter 4.6 answers them (docs/vehicle-setup.md)."""

from __future__ import annotations

from typing import Final

from simulator.command_message import ACCEPTED, FAILED, TEMPORARILY_REJECTED, UNSUPPORTED, Command
from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.flight_state import FlightState
from simulator.notices import Severity
from simulator.setup_state import VehicleSetup

LATER: Final = -1
"""A handler's result: the acknowledgement follows (`VehicleSetup.answers`)."""
IN_PROGRESS: Final = int(mavlink.MAV_RESULT_IN_PROGRESS)
CALIBRATION: Final = int(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION)
GYRO_S: Final = 0.54
LEVEL_S: Final = 1.06
BARO_S: Final = 0.48
MAX_TEST_S: Final = 600.0
BETWEEN_MOTORS_S: Final = 0.5
MAX_PERCENT: Final = 100.0


def calibrate(flight: FlightState, command: Command) -> int:
    """PREFLIGHT_CALIBRATION. Level and gyroscope block the real one, so their answer is late."""
    if flight.armed:
        flight.notify(Severity.NOTICE, "Disarm to allow calibration")
        return FAILED
    setup, now_s = flight.setup, flight.now_s
    params = command.raw if command.is_long else (*command.raw, 0.0, 0.0, 0.0)
    if params[0] == 1.0:
        return _answer(setup, now_s, GYRO_S)
    if params[2] == 1.0:
        flight.notify(Severity.INFO, "Updating barometer calibration")
        flight.notify(Severity.INFO, "Barometer calibration complete")
        setup.answers.append((now_s + BARO_S, CALIBRATION, ACCEPTED))
        return IN_PROGRESS
    if setup.pose is not None and params[4] in (1.0, 2.0, 4.0):
        return ACCEPTED if params[4] == 1.0 else TEMPORARILY_REJECTED
    if params[4] == 1.0:
        flight.notify(Severity.INFO, "Initialising ArduPilot")
        setup.ask_for_pose(1, flight, GYRO_S)
        return _answer(setup, now_s, GYRO_S)
    if params[4] in (2.0, 4.0):
        flight.notify(Severity.INFO, "Initialising ArduPilot")
        if params[4] == 2.0:
            setup.texts.append((now_s + LEVEL_S, Severity.INFO, "Trim OK: roll=0.01 pitch=-0.01 yaw=0.00"))
        return _answer(setup, now_s, LEVEL_S)
    return UNSUPPORTED


def take_pose(flight: FlightState, command: Command) -> int:
    """ACCELCAL_VEHICLE_POS: only the position that was asked for counts."""
    setup = flight.setup
    if setup.pose is None or command.params[0] != float(setup.pose):
        return FAILED
    setup.measure_from(flight.now_s)
    return ACCEPTED


def start_compass(flight: FlightState, command: Command) -> int:
    """Started again while it runs, it begins anew."""
    del command
    if flight.armed:
        flight.notify(Severity.NOTICE, "Disarm to allow compass calibration")
        return FAILED
    flight.setup.compass_since_s = flight.now_s
    return ACCEPTED


def keep_compass(flight: FlightState, command: Command) -> int:
    """Accepted where there is nothing to keep, refused while it runs or has failed."""
    del command
    setup = flight.setup
    if not setup.compass_runs:
        return ACCEPTED
    if setup.percent(flight.now_s) < 100 or Failure.CALIBRATION_FAILS in flight.failures:
        return FAILED
    setup.compass_since_s, setup.compass_kept = None, True
    return ACCEPTED


def cancel_compass(flight: FlightState, command: Command) -> int:
    """The real one wants a reboot after a cancelled one too."""
    del command
    setup = flight.setup
    setup.compass_kept = setup.compass_kept or setup.compass_runs
    setup.compass_since_s = None
    return ACCEPTED


def spin_motor(flight: FlightState, command: Command) -> int:
    """DO_MOTOR_TEST. The real one accepts motors that it does not have, and throttles that it then refuses; and it
    tests an armed vehicle on the ground, which is disarmed at the end."""
    if not flight.landed:
        return FAILED
    params = command.raw if command.is_long else (*command.raw, 0.0, 0.0, 0.0)
    motor, percent, for_s, count = int(params[0]), params[2], params[3], max(1, int(params[4]))
    setup = flight.setup
    if setup.motor is None:
        flight.notify(Severity.INFO, "starting motor test")
    refuses = not 0.0 <= percent <= MAX_PERCENT
    span_s = 0.0 if refuses else min(for_s, MAX_TEST_S) * count + BETWEEN_MOTORS_S * (count - 1)
    setup.motor, setup.motor_until_s = motor, flight.now_s + span_s
    if flight.armed:
        flight.disarm()
    return ACCEPTED


def _answer(setup: VehicleSetup, now_s: float, after_s: float) -> int:
    setup.answers.append((now_s + after_s, CALIBRATION, ACCEPTED))
    return LATER
