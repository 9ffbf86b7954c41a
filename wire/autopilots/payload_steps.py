"""The steps of commands for servos and grippers. Pure.

ArduPilot moves an output by DO_SET_SERVO, and refuses one that a motor or another function has. PX4 knows no
DO_SET_SERVO: DO_SET_ACTUATOR sets six values between -1 and 1, which go to the outputs with the function "Peripheral
via Actuator Set". It accepts that also where no output has the function. Sources: ArduPilot 4.6 and PX4 1.15, read.
"""

from __future__ import annotations

from typing import Final

from wire.autopilots.commands import CommandStep, NotSupported, Steps, VehicleState
from wire.autopilots.common import command_long
from wire.autopilots.payload_commands import MoveGripper, SetServo
from wire.dialect import mavlink

_M: Final = mavlink
PX4_ACTUATORS: Final = 6
PX4_MIN_US: Final = 1000
PX4_MAX_US: Final = 2000
"""What -1 and 1 are on an output with the usual PWM_MAIN_MINn and MAXn."""
_KEPT: Final = None
"""NaN: this actuator stays where it is."""
_FIRST_SET: Final = 0.0


def set_servo(state: VehicleState, command: SetServo) -> Steps:
    """ArduPilot, and every servo of the companion computer."""
    work = command_long(_M.MAV_CMD_DO_SET_SERVO, float(command.servo), float(command.pulse_us))
    return (CommandStep(f"moving servo {command.servo} to {command.pulse_us} \u00b5s", work),)


def px4_set_servo(state: VehicleState, command: SetServo) -> Steps:
    """A higher number than PX4 has actuators can only be a servo of the companion computer."""
    if command.servo > PX4_ACTUATORS:
        return set_servo(state, command)
    if not PX4_MIN_US <= command.pulse_us <= PX4_MAX_US:
        raise NotSupported(
            f"{state.name} flies PX4, which moves an actuator between its output's ends: "
            f"{PX4_MIN_US} to {PX4_MAX_US} \u00b5s, not {command.pulse_us}"
        )
    middle, half = (PX4_MIN_US + PX4_MAX_US) / 2, (PX4_MAX_US - PX4_MIN_US) / 2
    value = (command.pulse_us - middle) / half
    values = [value if number == command.servo else _KEPT for number in range(1, PX4_ACTUATORS + 1)]
    work = command_long(_M.MAV_CMD_DO_SET_ACTUATOR, *values, _FIRST_SET)
    return (CommandStep(f"moving actuator {command.servo} to {value:g}", work),)


def move_gripper(state: VehicleState, command: MoveGripper) -> Steps:
    """Both autopilots. PX4 answers only once the gripper has moved, and a PX4 without a gripper does not answer."""
    action = _M.GRIPPER_ACTION_GRAB if command.grab else _M.GRIPPER_ACTION_RELEASE
    work = command_long(_M.MAV_CMD_DO_GRIPPER, float(command.gripper), float(action))
    return (CommandStep("grabbing the load" if command.grab else "releasing the load", work),)
