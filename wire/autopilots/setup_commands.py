"""The steps of calibrations, motor tests and reboots for ArduPilot and PX4. Measured on ArduCopter 4.6
(docs/vehicle-setup.md); those of PX4 follow its documentation. Pure."""

from __future__ import annotations

from typing import Final

from wire.autopilots.commands import (
    Calibrate,
    CalibrationPose,
    CommandStep,
    EndCalibration,
    NotSupported,
    Reboot,
    Sensor,
    SpinMotor,
    Steps,
    VehicleState,
)
from wire.autopilots.common import command_long
from wire.dialect import mavlink

_M: Final = mavlink
_PERCENT: Final = 0.0
"""param2 of DO_MOTOR_TEST: the throttle is a percentage."""
_ALL: Final = 0.0
_RETRY: Final = 1.0

_ARDUPILOT: Final[dict[Sensor, tuple[float, ...]]] = {
    Sensor.ACCELEROMETER: (0.0, 0.0, 0.0, 0.0, 1.0),
    Sensor.LEVEL: (0.0, 0.0, 0.0, 0.0, 2.0),
    Sensor.GYROSCOPE: (1.0,),
    Sensor.BAROMETER: (0.0, 0.0, 1.0),
}
"""Parameters of PREFLIGHT_CALIBRATION. The compass has commands of its own: that one is refused."""
_PX4: Final[dict[Sensor, tuple[float, ...]]] = _ARDUPILOT | {Sensor.COMPASS: (0.0, 1.0)}


def ardupilot_calibrate(state: VehicleState, command: Calibrate) -> Steps:
    """A compass that fails tries again by itself; its result waits to be kept."""
    phase = f"calibrating the {command.sensor}"
    if command.sensor is Sensor.COMPASS:
        return (CommandStep(phase, command_long(_M.MAV_CMD_DO_START_MAG_CAL, _ALL, _RETRY)),)
    return (CommandStep(phase, command_long(_M.MAV_CMD_PREFLIGHT_CALIBRATION, *_ARDUPILOT[command.sensor])),)


def ardupilot_pose(state: VehicleState, command: CalibrationPose) -> Steps:
    work = command_long(_M.MAV_CMD_ACCELCAL_VEHICLE_POS, float(command.pose))
    return (CommandStep(f"measuring position {command.pose} of 6", work),)


def ardupilot_end(state: VehicleState, command: EndCalibration) -> Steps:
    """Only the compass: nothing ends the calibration of an accelerometer but its end, or a reboot."""
    if command.keep:
        return (CommandStep("keeping the calibration", command_long(_M.MAV_CMD_DO_ACCEPT_MAG_CAL, _ALL)),)
    return (CommandStep("cancelling the calibration", command_long(_M.MAV_CMD_DO_CANCEL_MAG_CAL, _ALL)),)


def ardupilot_test_motor(state: VehicleState, command: SpinMotor) -> Steps:
    params = (float(command.motor), _PERCENT, command.throttle_percent, command.for_s, 1.0)
    return (_motor_step(command, _M.MAV_CMD_DO_MOTOR_TEST, *params),)


def px4_calibrate(state: VehicleState, command: Calibrate) -> Steps:
    """It guides through the rest by texts that begin with "[cal]"."""
    work = command_long(_M.MAV_CMD_PREFLIGHT_CALIBRATION, *_PX4[command.sensor])
    return (CommandStep(f"calibrating the {command.sensor}", work),)


def px4_end(state: VehicleState, command: EndCalibration) -> Steps:
    if command.keep:
        raise NotSupported(f"{state.name} keeps the result by itself")
    return (CommandStep("cancelling the calibration", command_long(_M.MAV_CMD_PREFLIGHT_CALIBRATION)),)


def px4_test_motor(state: VehicleState, command: SpinMotor) -> Steps:
    """Actuator functions number the motors from 1."""
    params = (command.throttle_percent / 100.0, command.for_s, 0.0, 0.0, float(command.motor))
    return (_motor_step(command, _M.MAV_CMD_ACTUATOR_TEST, *params),)


def reboot(state: VehicleState, command: Reboot) -> Steps:
    """Both autopilots."""
    return (CommandStep("rebooting", command_long(_M.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1.0)),)


def _motor_step(command: SpinMotor, number: int, *params: float) -> CommandStep:
    phase = f"turning motor {command.motor} at {command.throttle_percent:g} % for {command.for_s:g} s"
    return CommandStep(phase, command_long(number, *params))
