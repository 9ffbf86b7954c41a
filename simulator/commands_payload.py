"""Servos and grippers, as ArduCopter 4.6 answers their commands. PX4's are in `px4.payload`."""

from __future__ import annotations

from simulator.command_message import ACCEPTED, FAILED, Command
from simulator.dialect import mavlink
from simulator.flight import Flight
from simulator.notices import Severity
from simulator.payload_drop import drop
from simulator.servo_outputs import OUTPUTS

GRIPPER_FUNCTION = 28
FREE_FUNCTIONS = frozenset({0, 1, 22, 23, GRIPPER_FUNCTION, *range(51, 67)})
"""SERVOn_FUNCTION of outputs that a command may move: none, pass-through, sprayer, gripper."""


def set_servo(flight: Flight, command: Command) -> int:
    """DO_SET_SERVO. The real one checks the function of the output, and sends any pulse."""
    output, pulse_us = int(command.params[0]) & 0xFF, int(command.params[1]) & 0xFFFF
    if not 1 <= output <= OUTPUTS:
        return FAILED
    if int(flight.parameters[f"SERVO{output}_FUNCTION"]) not in FREE_FUNCTIONS:
        flight.notify(Severity.INFO, f"ServoRelayEvent: Channel {output} is already in use")
        return FAILED
    flight.outputs.set(output, pulse_us)
    return ACCEPTED


def move_gripper(flight: Flight, command: Command) -> int:
    """DO_GRIPPER. The real one ignores the number of the gripper, and accepts the command also without an output for
    it: then it never says that the load is grabbed."""
    action = int(command.params[1])
    if flight.parameters["GRIP_ENABLE"] == 0.0:
        return FAILED
    if action not in (mavlink.GRIPPER_ACTION_RELEASE, mavlink.GRIPPER_ACTION_GRAB):
        return FAILED
    outputs = (n for n in range(1, OUTPUTS + 1) if flight.parameters[f"SERVO{n}_FUNCTION"] == GRIPPER_FUNCTION)
    grabs = action == mavlink.GRIPPER_ACTION_GRAB
    if not grabs and flight.outputs.grips is not False:
        drop(flight)
    text = flight.outputs.grip(grabs, flight.now_s, output=next(outputs, None))
    if text:
        flight.notify(Severity.INFO, text)
    return ACCEPTED
