"""The autopilot's own reactions: radio, ground station, battery, position."""

from __future__ import annotations

import pytest

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.modes import Mode

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
HEARTBEAT = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def test_without_a_radio_sticks_that_stop_are_a_radio_failsafe_one_second_later(ground):
    station = ground(receiver="none").take_off()
    station.set_mode(Mode.LOITER)
    station.run(1)
    station.sticks = None
    took_s = station.until(lambda: station.flight.mode is Mode.RTL, 10)
    assert 0.9 <= took_s <= 1.2
    assert "Radio Failsafe" in station.texts()
    assert abs(station.body.alt_m - 10) < 1.0  # held until then, not flown into the ground
    assert station.flight.sticks.overridden  # the last sticks are still in force, but do not count
    assert station.of("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_CRITICAL


def test_sticks_that_return_clear_the_failsafe_but_not_the_mode(ground):
    station = ground(receiver="none").take_off()
    station.set_mode(Mode.LOITER)
    station.sticks = None
    station.until(lambda: station.flight.mode is Mode.RTL, 10)
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.run(1)
    assert "Radio Failsafe Cleared" in station.texts()
    assert station.flight.mode is Mode.RTL


def test_with_a_radio_lapsing_sticks_are_no_failsafe(ground):
    station = ground().take_off()
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.set_mode(Mode.LOITER)
    station.sticks = None
    station.run(6)
    assert station.flight.mode is Mode.LOITER
    assert "Radio Failsafe" not in station.texts()


def test_a_radio_that_loses_its_transmitter_brings_the_vehicle_home(ground):
    station = ground().take_off()
    station.set_mode(Mode.LOITER)
    station.vehicle.failures.add(Failure.RADIO_LOST)
    assert station.until(lambda: station.flight.mode is Mode.RTL, 5) == pytest.approx(1.0, abs=0.2)


def test_fs_options_let_guided_continue(ground):
    station = ground(receiver="none", parameters={"FS_OPTIONS": 4}).take_off()
    station.sticks = None
    station.run(6)
    assert station.flight.mode is Mode.GUIDED
    assert "Radio Failsafe - Continuing Guided Mode" in station.texts()


def test_fs_thr_enable_chooses_what_happens(ground):
    for enable, mode in ((0, Mode.LOITER), (3, Mode.LAND)):
        station = ground(receiver="none", parameters={"FS_THR_ENABLE": enable}).take_off()
        station.set_mode(Mode.LOITER)
        station.sticks = None
        station.run(6)
        assert station.flight.mode is mode


def test_on_the_ground_a_radio_failsafe_disarms(ground):
    station = ground(receiver="none").ready()
    station.sticks = station.override(1500, 1500, 1000, 1500)
    station.run(0.5)
    assert station.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    station.sticks = None
    station.until(lambda: not station.flight.armed, 5)
    assert "Radio Failsafe - Disarming" in station.texts()
    assert station.command(ARM, 1) == mavlink.MAV_RESULT_FAILED
    assert "Arm: Radio failsafe on" in station.texts()


def test_without_radio_and_sticks_arming_is_refused(ground):
    station = ground(receiver="none").ready()
    assert station.command(ARM, 1) == mavlink.MAV_RESULT_FAILED
    assert "Arm: RC not found" in station.texts()


def test_ground_station_failsafe_fires_clears_and_keeps_the_mode(ground):
    station = ground(parameters={"FS_GCS_ENABLE": 1}).take_off()
    for _ in range(5):
        station.send(HEARTBEAT)
        station.run(1)
    took_s = station.until(lambda: station.flight.mode is Mode.RTL, 10)
    assert took_s == pytest.approx(4.0, abs=0.2)
    assert "GCS Failsafe" in station.texts()
    station.send(HEARTBEAT)
    station.run(0.2)
    assert "GCS Failsafe Cleared" in station.texts()
    assert station.flight.mode is Mode.RTL


def test_ground_station_failsafe_never_fires_if_none_was_seen_or_another_sysid_was(ground):
    station = ground(parameters={"FS_GCS_ENABLE": 1}).take_off()
    station.send(HEARTBEAT, sysid=77)
    station.run(10)
    assert station.flight.mode is Mode.GUIDED


def test_streamed_sticks_hide_the_loss_of_the_operator(ground):
    station = ground(parameters={"FS_GCS_ENABLE": 1}).take_off()
    station.send(HEARTBEAT)
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.run(10)
    assert station.flight.mode is Mode.GUIDED


def test_ground_station_failsafe_leaves_pilots_alone_by_default(ground):
    station = ground(parameters={"FS_GCS_ENABLE": 1}).take_off()
    station.set_mode(Mode.LOITER)
    station.send(HEARTBEAT)
    station.run(7)
    assert station.flight.mode is Mode.LOITER
    assert "GCS Failsafe - Continuing Pilot Control" in station.texts()


def test_a_low_battery_returns_and_a_critical_one_lands(ground):
    station = ground(parameters={"BATT_LOW_VOLT": 15.0, "BATT_CRT_VOLT": 12.0}).take_off()
    station.vehicle.failures.add(Failure.BATTERY_LOW)
    took_s = station.until(lambda: station.flight.mode is Mode.RTL, 20)
    assert took_s == pytest.approx(10, abs=0.5)
    assert "Battery Failsafe" in station.texts()
    station.vehicle.parameters.set("BATT_CRT_VOLT", 16.0)
    station.until(lambda: station.flight.mode is Mode.LAND, 20)
    station.until(lambda: not station.flight.armed, 60)
    assert station.command(ARM, 1) == mavlink.MAV_RESULT_FAILED


def test_a_battery_empties_by_flying(ground):
    station = ground(battery_mah=300).take_off()
    used = station.flight.battery.used_mah
    volts = station.flight.battery.voltage_v
    station.run(20)
    assert station.flight.battery.used_mah - used == pytest.approx(80, rel=0.2)
    assert station.flight.battery.voltage_v < volts


def test_losing_the_position_in_a_mode_that_needs_it_lands(ground):
    station = ground().take_off()
    station.vehicle.failures.add(Failure.GPS_LOST)
    took_s = station.until(lambda: station.flight.mode is Mode.LAND, 10)
    assert took_s == pytest.approx(7, abs=0.3)
    assert any(text.startswith("EKF Failsafe") for text in station.texts())
    station.until(lambda: not station.flight.armed, 60)


def test_a_fall_is_noticed_as_a_crash(ground):
    station = ground().take_off(30)
    station.command(ARM, 0, 21196)
    station.flight.armed = True  # the motors are stopped although the vehicle believes it flies
    station.flight._behaviours[station.flight.mode].run = lambda: None
    station.flight.commands = (0.0, 0.0, 0.0, 0.0)
    station.until(lambda: station.body.on_ground, 10)
    station.run(0.1)
    assert "Crash: Disarming" in station.texts()
    assert not station.flight.armed
