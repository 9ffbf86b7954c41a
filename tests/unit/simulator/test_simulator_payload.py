"""Servos, actuators and the gripper: the answers, and what SERVO_OUTPUT_RAW shows."""

from __future__ import annotations

import math

import pytest

from simulator.dialect import mavlink as M
from simulator.px4.flavour import PX4

ACCEPTED, FAILED = 0, 4
SERVO, GRIPPER, ACTUATOR = M.MAV_CMD_DO_SET_SERVO, M.MAV_CMD_DO_GRIPPER, M.MAV_CMD_DO_SET_ACTUATOR
GRAB, RELEASE = 1, 0
OUTPUTS = M.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW


def outputs(station):
    station.command(M.MAV_CMD_REQUEST_MESSAGE, OUTPUTS)
    message = station.of("SERVO_OUTPUT_RAW")[-1]
    return [getattr(message, f"servo{number}_raw") for number in range(1, 17)]


def test_a_servo_moves_to_its_pulse_and_shows_it(ground):
    station = ground().ready()
    assert outputs(station) == [1000] * 4 + [0] * 12
    assert station.command(SERVO, 9, 1750) == ACCEPTED
    assert outputs(station) == [1000] * 4 + [0] * 4 + [1750] + [0] * 7


@pytest.mark.parametrize("output", [1, 4])
def test_a_motor_is_no_servo(ground, output):
    station = ground().ready()
    assert station.command(SERVO, output, 1900) == FAILED
    assert f"ServoRelayEvent: Channel {output} is already in use" in station.texts()
    assert outputs(station)[output - 1] == 1000


@pytest.mark.parametrize("output", [0, 17, 300])
def test_an_output_that_is_not_there_is_refused(ground, output):
    assert ground().ready().command(SERVO, output, 1500) == FAILED


def test_without_a_gripper_nothing_is_released(ground):
    station = ground().ready()
    assert station.command(GRIPPER, 1, RELEASE) == FAILED
    assert outputs(station)[4:] == [0] * 12


def test_a_gripper_grabs_and_releases_and_says_when_it_has(ground):
    station = ground(parameters={"GRIP_ENABLE": 1, "SERVO9_FUNCTION": 28}).ready()
    assert station.command(GRIPPER, 1, GRAB) == ACCEPTED
    assert station.texts()[-1] == "Gripper load grabbing"
    assert outputs(station)[8] == 1900
    assert station.until(lambda: station.texts()[-1] == "Gripper load grabbed", 1.0) < 0.5
    assert station.command(GRIPPER, 1, GRAB) == ACCEPTED
    assert station.texts()[-2:] == ["Gripper load grabbed"] * 2
    assert station.command(GRIPPER, 1, RELEASE) == ACCEPTED
    assert outputs(station)[8] == 1100
    station.until(lambda: station.texts()[-1] == "Gripper load released", 1.0)
    assert station.command(GRIPPER, 1, 7) == FAILED


def test_a_gripper_without_an_output_never_says_that_it_has_grabbed(ground):
    station = ground(parameters={"GRIP_ENABLE": 1}).ready()
    assert station.command(GRIPPER, 1, GRAB) == ACCEPTED
    station.run(3)
    assert "Gripper load grabbed" not in station.texts()
    assert outputs(station)[4:] == [0] * 12


def test_px4_moves_only_the_actuators_that_are_named(ground):
    station = ground(flavour=PX4).ready()
    assert station.command(ACTUATOR, 0.5, -1, *[math.nan] * 4, 0) == ACCEPTED
    assert station.command(ACTUATOR, math.nan, 1, *[math.nan] * 4, 0) == ACCEPTED
    assert outputs(station)[4:7] == [1750, 2000, 0]
    assert station.command(ACTUATOR, -1, *[math.nan] * 5, 1) == ACCEPTED  # of another set
    assert outputs(station)[4] == 1750


def test_px4_knows_no_command_for_a_servo(ground):
    assert ground(flavour=PX4).ready().command(SERVO, 5, 1500) == M.MAV_RESULT_UNSUPPORTED


def test_px4_answers_when_its_gripper_has_moved_and_without_one_never(ground):
    without = ground(flavour=PX4).ready()
    assert without.command(GRIPPER, 1, GRAB) is None
    without.run(5)
    assert not [one for one in without.of("COMMAND_ACK") if one.command == GRIPPER]
    station = ground(flavour=PX4, parameters={"PD_GRIPPER_EN": 1}).ready()
    assert station.command(GRIPPER, 1, GRAB) is None
    done = [one for one in station.of("COMMAND_ACK") if one.command == GRIPPER]
    assert not done
    station.run(1.5)
    assert [one.result for one in station.of("COMMAND_ACK") if one.command == GRIPPER] == [ACCEPTED]
    assert outputs(station)[10] == 1900
