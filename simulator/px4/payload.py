"""Actuators and the gripper, as PX4 1.15 answers their commands (read, not measured)."""

from __future__ import annotations

import math

from simulator.command_message import ACCEPTED, UNSUPPORTED, Command
from simulator.dialect import mavlink
from simulator.flight import Flight
from simulator.payload_drop import drop
from simulator.servo_outputs import MOTORS
from simulator.vehicle_setup import LATER

ACTUATORS = 6
MIDDLE_US, HALF_US = 1500, 500
GRIPPER_TIMEOUT_S = 1.0
NO_ANSWER = LATER


def set_actuator(flight: Flight, command: Command) -> int:
    """DO_SET_ACTUATOR: accepted whatever outputs there are. Here actuator 1 to 6 are the outputs behind the motors."""
    if not command.is_long:
        return UNSUPPORTED
    if command.raw[6] == 0.0:
        for at, value in enumerate(command.given[:ACTUATORS]):
            if math.isfinite(value):
                pulse_us = round(MIDDLE_US + HALF_US * min(max(value, -1.0), 1.0))
                flight.outputs.set(MOTORS + 1 + at, pulse_us)
    return ACCEPTED


def move_gripper(flight: Flight, command: Command) -> int:
    """DO_GRIPPER: acknowledged when the gripper has moved, and by nobody where PX4 has none set up."""
    action = int(command.params[1])
    known = action in (mavlink.GRIPPER_ACTION_RELEASE, mavlink.GRIPPER_ACTION_GRAB)
    if flight.parameters["PD_GRIPPER_EN"] == 0.0 or not known:
        return NO_ANSWER
    grabs = action == mavlink.GRIPPER_ACTION_GRAB
    if not grabs and flight.outputs.grips is not False:
        drop(flight)
    flight.outputs.grip(grabs, flight.now_s, output=MOTORS + ACTUATORS + 1)
    flight.setup.answers.append((flight.now_s + GRIPPER_TIMEOUT_S, command.number, ACCEPTED))
    return LATER
