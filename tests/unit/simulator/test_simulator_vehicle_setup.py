"""Calibrations, motor tests and reboots, as a real ArduCopter answered them (docs/vehicle-setup.md)."""

from __future__ import annotations

import pytest

from simulator.dialect import mavlink as M
from simulator.failure_modes import Failure
from simulator.px4.flavour import PX4
from simulator.setup_state import FAILURE, SUCCESS

ACCEPTED, REJECTED, UNSUPPORTED, FAILED, IN_PROGRESS = 0, 1, 3, 4, 5
CALIBRATE, POSE = M.MAV_CMD_PREFLIGHT_CALIBRATION, M.MAV_CMD_ACCELCAL_VEHICLE_POS
START, KEEP, CANCEL = M.MAV_CMD_DO_START_MAG_CAL, M.MAV_CMD_DO_ACCEPT_MAG_CAL, M.MAV_CMD_DO_CANCEL_MAG_CAL


def acks(station, number):
    return [m.result for _, m in station.heard if m.get_type() == "COMMAND_ACK" and m.command == number]


def prompts(station):
    return [m.param1 for m in station.of("COMMAND_LONG") if m.command == POSE]


def armed(station):
    assert station.command(M.MAV_CMD_COMPONENT_ARM_DISARM, 1, 21196) == ACCEPTED
    return station


@pytest.mark.parametrize(
    ("params", "after_s", "text"),
    [
        ((1,), 0.54, None),
        ((0, 0, 0, 0, 2), 1.06, "Trim OK: roll=0.01 pitch=-0.01 yaw=0.00"),
        ((0, 0, 0, 0, 4), 1.06, None),
    ],
)
def test_what_blocks_the_autopilot_answers_late(ground, params, after_s, text):
    station = ground().ready()
    assert station.command(CALIBRATE, *params) is None  # within a tenth of a second
    took = station.until(lambda: acks(station, CALIBRATE) == [ACCEPTED], 2)
    assert took + 0.1 == pytest.approx(after_s, abs=0.05)
    assert text is None or text in station.texts()


def test_the_barometer_says_that_it_works(ground):
    station = ground().ready()
    assert station.command(CALIBRATE, 0, 0, 1) == IN_PROGRESS
    station.run(0.5)
    assert acks(station, CALIBRATE) == [IN_PROGRESS, ACCEPTED]
    assert "Barometer calibration complete" in station.texts()


def test_six_positions_in_their_order(ground):
    station = ground().ready()
    assert station.command(POSE, 1) == FAILED  # nobody asked
    station.command(CALIBRATE, 0, 0, 0, 0, 1)
    station.until(lambda: prompts(station) == [1.0])
    assert "Place vehicle level and press any key." in station.texts()
    station.until(lambda: prompts(station) == [1.0, 1.0], 1.2)  # it repeats itself
    assert station.command(POSE, 2) == FAILED
    assert station.command(CALIBRATE, 0, 0, 0, 0, 2) == REJECTED
    assert station.command(CALIBRATE) == UNSUPPORTED  # nothing cancels it
    for pose in range(1, 7):
        station.until(lambda pose=pose: prompts(station)[-1] == pose, 3)
        assert station.command(POSE, pose) == ACCEPTED
    station.until(lambda: prompts(station)[-1] == SUCCESS, 3)
    assert "Calibration successful" in station.texts()


def test_a_failed_one_keeps_it_from_arming(ground):
    station = ground(failures={Failure.CALIBRATION_FAILS}).ready()
    station.command(CALIBRATE, 0, 0, 0, 0, 1)
    for pose in (1, 2):
        station.until(lambda pose=pose: prompts(station)[-1:] == [pose], 3)
        station.command(POSE, pose)
    station.until(lambda: prompts(station)[-1] == FAILURE, 3)
    assert "Calibration FAILED" in station.texts()
    assert station.command(M.MAV_CMD_COMPONENT_ARM_DISARM, 1) == FAILED
    assert any("3D Accel calibration needed" in text for text in station.texts())
    assert station.command(M.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == ACCEPTED
    count = len(prompts(station))
    station.run(3)
    assert len(prompts(station)) <= count + 1


def test_the_compass_reports_its_progress_where_it_is_requested(ground):
    station = ground().ready()
    assert station.command(KEEP) == station.command(CANCEL) == ACCEPTED  # nothing runs
    for number in (191, 192):
        assert station.command(M.MAV_CMD_SET_MESSAGE_INTERVAL, number, 200_000) == ACCEPTED
    assert station.command(START, 0, 1) == ACCEPTED
    station.run(5)
    assert {m.compass_id for m in station.of("MAG_CAL_PROGRESS")} == {0, 1, 2}
    assert 15 <= station.of("MAG_CAL_PROGRESS")[-1].completion_pct <= 30
    assert station.command(KEEP) == FAILED
    assert station.command(M.MAV_CMD_COMPONENT_ARM_DISARM, 1) == FAILED
    assert any("Compass calibration running" in text for text in station.texts())
    station.until(lambda: len({m.compass_id for m in station.of("MAG_CAL_REPORT")}) == 3, 20)
    assert station.of("MAG_CAL_REPORT")[-1].cal_status == M.MAG_CAL_SUCCESS
    assert station.command(KEEP) == ACCEPTED
    count = len(station.of("MAG_CAL_REPORT"))
    station.run(2)
    assert len(station.of("MAG_CAL_REPORT")) <= count + 1
    assert station.flight.why_not_ready() == "PreArm: Compass calibrated requires reboot"


def test_a_motor_test_ends_by_itself(ground):
    station = ground().ready()
    assert station.command(M.MAV_CMD_DO_MOTOR_TEST, 2, 0, 5, 1.0, 1) == ACCEPTED
    assert station.flight.setup.motor == 2
    station.run(1.1)
    assert station.flight.setup.motor is None
    texts = [text for text in station.texts() if "motor test" in text]
    assert texts == ["starting motor test", "finished motor test"]
    station.command(M.MAV_CMD_DO_MOTOR_TEST, 2, 0, 150, 1.0, 1)  # accepted, and over at once
    assert station.flight.setup.motor is None


def test_an_armed_one_calibrates_nothing(ground):
    station = armed(ground().ready())
    assert station.command(CALIBRATE, 0, 0, 0, 0, 2) == station.command(START, 0, 1) == FAILED
    assert {"Disarm to allow calibration", "Disarm to allow compass calibration"} <= set(station.texts())
    # The real one tests motors of an armed vehicle on the ground, which is disarmed then.
    assert station.command(M.MAV_CMD_DO_MOTOR_TEST, 1, 0, 5, 1.0, 1) == ACCEPTED
    assert not station.flight.armed


def test_px4_tells_it_in_texts(ground):
    station = ground(flavour=PX4).ready()
    assert station.command(CALIBRATE, 1) == ACCEPTED
    station.run(3)
    texts = [text for text in station.texts() if text.startswith("[cal]")]
    assert (texts[0], texts[-1]) == ("[cal] calibration started: 2 gyro", "[cal] calibration done: gyro")
    station.command(CALIBRATE, 0, 1)
    assert station.command(CALIBRATE) == ACCEPTED
    station.run(0.1)
    assert station.texts()[-1] == "[cal] calibration cancelled"
