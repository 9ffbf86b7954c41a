"""Units, rates and details of the vehicle's telemetry."""

from __future__ import annotations

import math

import pytest

from simulator.ardupilot import ARDUPILOT
from simulator.dialect import mavlink
from simulator.failure_modes import Failure, PlannedFailure
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.modes import Mode
from simulator.vehicle import Vehicle, VehicleSettings

ACCEPTED, DENIED, FAILED = 0, 2, 4
SET_INTERVAL, GET_INTERVAL = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_CMD_GET_MESSAGE_INTERVAL
REQUEST = mavlink.MAV_CMD_REQUEST_MESSAGE
NAMED_IN_THE_ISSUE = [
    "HEARTBEAT", "SYS_STATUS", "GPS_RAW_INT", "GLOBAL_POSITION_INT", "ATTITUDE", "VFR_HUD", "EKF_STATUS_REPORT",
    "BATTERY_STATUS", "HOME_POSITION", "EXTENDED_SYS_STATE", "AUTOPILOT_VERSION",
]  # fmt: skip


def ask(station, name: str):
    number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    assert station.command(REQUEST, number) == ACCEPTED
    return station.of(name)[-1]


@pytest.mark.parametrize("name", NAMED_IN_THE_ISSUE)
def test_every_named_message_can_be_asked_for(ground, name):
    assert ask(ground().ready(), name).get_type() == name


@pytest.mark.parametrize("number", sorted(ARDUPILOT.reports))
def test_every_report_can_be_built_in_flight(ground, number):
    station = ground().take_off(3)
    assert station.command(REQUEST, number) == ACCEPTED
    assert any(m.get_msgId() == number for _, m in station.heard[-4:])


def test_scaling_of_position_and_speed(ground):
    station = ground(heading_deg=90).take_off(10)
    station.send(
        mavlink.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, 1, 0b110111000111, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0
        )
    )
    station.run(2.5)
    body, place = station.body, station.flight.place()
    m = ask(station, "GLOBAL_POSITION_INT")
    assert m.lat == pytest.approx(place.lat_deg * 1e7, abs=40)
    assert m.lon == pytest.approx(place.lon_deg * 1e7, abs=80)
    assert m.alt == pytest.approx(498_000, abs=150)
    assert m.relative_alt == pytest.approx(10_000, abs=150)
    assert m.vy == pytest.approx(body.ve_mps * 100, abs=15)
    assert m.hdg == pytest.approx(9000, abs=200)
    gps = ask(station, "GPS_RAW_INT")
    assert gps.fix_type == 6
    assert gps.vel == pytest.approx(body.ground_speed_mps() * 100, abs=15)
    assert gps.cog == pytest.approx(9000, abs=100)
    hud = ask(station, "VFR_HUD")
    assert hud.heading == pytest.approx(90, abs=2)
    assert hud.alt == pytest.approx(498, abs=0.2)
    attitude = ask(station, "ATTITUDE")
    assert attitude.yaw == pytest.approx(math.pi / 2, abs=0.05)
    battery = ask(station, "BATTERY_STATUS")
    assert 14_000 < battery.voltages[0] < 16_800
    assert battery.voltages[1] == 65535
    status = ask(station, "SYS_STATUS")
    assert status.voltage_battery == pytest.approx(battery.voltages[0], abs=50)
    assert 1000 < status.current_battery < 2500  # centiamperes


def test_heartbeat_flags(ground):
    station = ground().ready()
    station.run(1)
    beat = station.of("HEARTBEAT")[-1]
    assert (beat.type, beat.autopilot, beat.base_mode, beat.system_status) == (2, 3, 1 | 16 | 64, 3)
    station.take_off()
    station.run(1)
    beat = station.of("HEARTBEAT")[-1]
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (1 | 8 | 16 | 64 | 128, 4, 4)


def test_landed_state_goes_through_all_four(ground):
    station = ground().ready()
    station.command(SET_INTERVAL, mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 100_000)
    station.take_off(5)
    station.run(1)
    station.set_mode(Mode.LAND)
    station.until(lambda: not station.flight.armed)
    station.run(0.5)
    states = [m.landed_state for m in station.of("EXTENDED_SYS_STATE")]
    changes = [s for i, s in enumerate(states) if i == 0 or s != states[i - 1]]
    assert changes == [1, 3, 2, 4, 1]


def test_before_there_is_a_position(ground):
    station = ground(boot_s=30)
    station.run(1)
    assert ask(station, "GPS_RAW_INT").fix_type == 1
    assert ask(station, "GLOBAL_POSITION_INT").lat == 0
    assert ask(station, "EKF_STATUS_REPORT").flags & mavlink.EKF_POS_HORIZ_ABS == 0
    assert station.command(REQUEST, mavlink.MAVLINK_MSG_ID_HOME_POSITION) == FAILED
    station.run(30)
    flags = ask(station, "EKF_STATUS_REPORT").flags
    assert flags & mavlink.EKF_POS_HORIZ_ABS and flags & mavlink.EKF_ATTITUDE
    assert station.command(REQUEST, mavlink.MAVLINK_MSG_ID_HOME_POSITION) == ACCEPTED


def test_intervals_set_get_stop_and_unknown(ground):
    station = ground().ready()
    attitude = mavlink.MAVLINK_MSG_ID_ATTITUDE
    station.command(GET_INTERVAL, attitude)
    assert station.of("MESSAGE_INTERVAL")[-1].interval_us == -1
    station.command(SET_INTERVAL, attitude, 40_000)
    station.command(GET_INTERVAL, attitude)
    assert station.of("MESSAGE_INTERVAL")[-1].interval_us == 40_000
    station.command(SET_INTERVAL, attitude, -1)
    assert "ATTITUDE" not in {m.get_type() for m in station.run(1)}
    assert station.command(SET_INTERVAL, 140, 100_000) == DENIED
    assert "No ap_message for mavlink id (140)" in station.texts()
    assert station.command(GET_INTERVAL, 140) == FAILED
    assert station.command(REQUEST, 140) == FAILED


def test_at_three_times_the_speed_messages_come_at_the_rate_of_a_real_vehicle(ground):
    station = ground(telemetry_pace=3.0).ready()
    station.command(SET_INTERVAL, mavlink.MAVLINK_MSG_ID_ATTITUDE, 100_000)
    station.command(GET_INTERVAL, mavlink.MAVLINK_MSG_ID_ATTITUDE)
    assert station.of("MESSAGE_INTERVAL")[-1].interval_us == 100_000
    heard = [m.get_type() for m in station.run(6)]
    assert 19 <= heard.count("ATTITUDE") <= 21
    assert heard.count("HEARTBEAT") == 2


def test_the_older_data_streams(ground):
    station = ground().ready()
    station.send(mavlink.MAVLink_request_data_stream_message(1, 1, 10, 10, 1))
    assert 19 <= len([m for m in station.run(2) if m.get_type() == "ATTITUDE"]) <= 21
    station.send(mavlink.MAVLink_request_data_stream_message(1, 1, 0, 2, 1))
    kinds = {m.get_type() for m in station.run(2)}
    assert {"SYS_STATUS", "GPS_RAW_INT", "GLOBAL_POSITION_INT", "VFR_HUD", "RC_CHANNELS"} <= kinds
    station.send(mavlink.MAVLink_request_data_stream_message(1, 1, 0, 0, 0))
    station.run(0.1)
    assert {m.get_type() for m in station.run(2)} <= {"HEARTBEAT", "TIMESYNC"}


def test_clock_questions_are_answered(ground):
    station = ground().ready()
    station.send(mavlink.MAVLink_timesync_message(0, 123456))
    station.send(mavlink.MAVLink_ping_message(5, 7, 0, 0))
    heard = station.run(0.1)
    sync = next(m for m in heard if m.get_type() == "TIMESYNC")
    assert (sync.ts1, sync.tc1 > 0) == (123456, True)
    ping = next(m for m in heard if m.get_type() == "PING")
    assert (ping.time_usec, ping.seq, ping.target_system, ping.target_component) == (5, 7, 255, 190)


def test_reboot_on_the_ground_only(ground):
    station = ground(boot_s=2).ready()
    reboot = mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
    station.command(SET_INTERVAL, mavlink.MAVLINK_MSG_ID_ATTITUDE, 100_000)
    station.vehicle.parameters.set("RTL_ALT", 3000)
    assert station.command(reboot, 1) == ACCEPTED
    station.run(0.3)
    assert station.flight.now_s < 1
    assert not station.flight.estimator.position_ok
    assert "ATTITUDE" not in {m.get_type() for m in station.run(1)}
    assert station.vehicle.parameters["RTL_ALT"] == 3000
    station.take_off()
    assert station.command(reboot, 1) == FAILED


def test_named_failures_of_commands_and_links(ground):
    station = ground(failures={Failure.COMMAND_ACK_MISSING}).ready()
    assert station.set_mode(Mode.LOITER) is None
    assert station.flight.mode is Mode.LOITER

    station = ground(failures={Failure.MODE_CHANGE_IGNORED}).ready()
    assert station.set_mode(Mode.LOITER) == ACCEPTED
    assert station.flight.mode is Mode.STABILIZE

    station = ground(failures={Failure.SILENT}).ready()
    assert station.run(5) == []


def test_a_failure_sets_in_when_it_is_planned():
    flight = FlightSettings(Place(47.0, 8.0, 400.0))
    vehicle = Vehicle(VehicleSettings(flight, failures=(PlannedFailure(2.0, Failure.SILENT),)))
    vehicle.step(1.9)
    assert len(vehicle.datagrams_to_send()) > 0
    vehicle.step(10.0)
    assert vehicle.failures == {Failure.SILENT}
    assert len(vehicle.datagrams_to_send()) == 0


def test_a_failure_ends_when_it_is_planned_to():
    planned = PlannedFailure(2.0, Failure.SILENT, 4.0)
    vehicle = Vehicle(VehicleSettings(FlightSettings(Place(47.0, 8.0, 400.0)), failures=(planned,)))
    vehicle.step(1.9)
    vehicle.datagrams_to_send()
    vehicle.step(3.9)
    vehicle.plan_failure(PlannedFailure(6.0, Failure.GPS_LOST, 7.0))
    assert vehicle.failures == {Failure.SILENT}
    vehicle.datagrams_to_send()
    vehicle.step(5.0)
    assert vehicle.failures == set()
    assert len(vehicle.datagrams_to_send()) > 0
    vehicle.step(6.5)
    assert vehicle.failures == {Failure.GPS_LOST}
    vehicle.step(7.5)
    assert vehicle.failures == set()
