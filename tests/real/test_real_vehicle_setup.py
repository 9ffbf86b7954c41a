"""What a real ArduCopter answers to calibrations, motor tests and reboots: the table in docs/vehicle-setup.md, which
the simulator follows."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Final

from real.by_wire import ACCEPTED, ByWire, by_wire

from bench.real_autopilot import Receiver
from bench.rig import wait_for
from wire.autopilots import setup_commands as setup
from wire.autopilots.commands import Calibrate, CalibrationPose, EndCalibration, Reboot, Sensor, SpinMotor, VehicleState
from wire.dialect import mavlink
from wire.transactions import CommandWork

FAILED: Final = mavlink.MAV_RESULT_FAILED
REJECTED: Final = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
STATE: Final = VehicleState("kestrel", 0, armed=False, airborne=False)
FORCE: Final = 21196.0


async def _ask(hands: ByWire, work: CommandWork) -> int:
    return await hands.truth.ask(work.command, *(value or 0.0 for value in work.params), within_s=8.0)


async def _says(hands: ByWire, text: str) -> None:
    await wait_for(text, lambda: any(text in said for _, said in hands.truth.texts), 10.0)


async def _set_up(hands: ByWire) -> None:
    for sensor, after_s in ((Sensor.LEVEL, 1.06), (Sensor.GYROSCOPE, 0.54)):
        began = hands.now
        assert await _ask(hands, setup.ardupilot_calibrate(STATE, Calibrate(sensor))[0].work) == ACCEPTED
        assert 0.5 * after_s < hands.now - began < 3 * after_s
    await _says(hands, "Trim OK")

    (motor,) = setup.ardupilot_test_motor(STATE, SpinMotor(1, 5, 1))
    assert await _ask(hands, motor.work) == ACCEPTED
    await _says(hands, "finished motor test")

    (compass,) = setup.ardupilot_calibrate(STATE, Calibrate(Sensor.COMPASS))
    assert await _ask(hands, compass.work) == ACCEPTED
    assert await _ask(hands, setup.ardupilot_end(STATE, EndCalibration(keep=True))[0].work) == FAILED
    assert await _ask(hands, setup.ardupilot_end(STATE, EndCalibration(keep=False))[0].work) == ACCEPTED

    (accel,) = setup.ardupilot_calibrate(STATE, Calibrate(Sensor.ACCELEROMETER))
    assert await _ask(hands, accel.work) == ACCEPTED
    await _says(hands, "Place vehicle level and press any key.")
    pose = [setup.ardupilot_pose(STATE, CalibrationPose(number))[0].work for number in (1, 2)]
    assert await _ask(hands, pose[1]) == FAILED  # asked for is the first
    assert await _ask(hands, setup.ardupilot_calibrate(STATE, Calibrate(Sensor.LEVEL))[0].work) == REJECTED
    assert await _ask(hands, pose[0]) == ACCEPTED
    await asyncio.sleep(1.5)
    assert await _ask(hands, pose[1]) == ACCEPTED
    await _says(hands, "Calibration FAILED")  # it still lies level


async def _armed(hands: ByWire) -> None:
    """Why the tower itself refuses the set-up of an armed drone."""
    assert await hands.truth.ask(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1, FORCE) == ACCEPTED
    assert await _ask(hands, setup.ardupilot_calibrate(STATE, Calibrate(Sensor.LEVEL))[0].work) == FAILED
    await _says(hands, "Disarm to allow calibration")
    (motor,) = setup.ardupilot_test_motor(STATE, SpinMotor(1, 5, 1))
    assert await _ask(hands, motor.work) == ACCEPTED
    await _says(hands, "finished motor test")
    await wait_for("it to be disarmed", lambda: not hands.truth.armed, 3.0)
    assert await _ask(hands, setup.reboot(STATE, Reboot())[0].work) == ACCEPTED


async def test_it_answers_as_the_simulator_does(arducopter: Path, tmp_path: Path) -> None:
    async with by_wire(arducopter, tmp_path, Receiver.LOW) as hands:
        await _set_up(hands)


async def test_it_tests_motors_while_armed(arducopter: Path, tmp_path: Path) -> None:
    async with by_wire(arducopter, tmp_path, Receiver.LOW) as hands:
        await _armed(hands)
