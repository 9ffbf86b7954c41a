"""Flight performance: each mode, by the figures that the rest of the product relies on."""

from __future__ import annotations

import math

import pytest

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.geodesy import e7
from simulator.modes import Mode

ACCEPTED, DENIED, FAILED = 0, 2, 4
GO_TO = mavlink.MAV_CMD_DO_REPOSITION


def place_e7(station, north_m: float, east_m: float) -> tuple[int, int]:
    place = station.flight.origin.to_place(north_m, east_m, 0)
    return e7(place.lat_deg), e7(place.lon_deg)


def test_take_off_settles_at_the_height_that_was_asked_for(ground):
    station = ground().take_off(10)
    highest = max(station.body.alt_m, 0)
    for _ in range(100):
        station.run(0.1)
        highest = max(highest, station.body.alt_m)
        assert abs(station.body.alt_m - 10) < 0.3
    assert highest < 10.3
    assert station.from_home_m() < 0.3


@pytest.mark.parametrize("wind_mps", [0.0, 5.0])
def test_go_to_arrives_within_half_a_metre_and_does_not_overshoot(ground, wind_mps):
    station = ground(wind_mps=wind_mps, wind_from_deg=240).take_off()
    x, y = place_e7(station, 60, 80)
    assert station.command_int(GO_TO, -1, 1, x=x, y=y, z=15, frame=6) == ACCEPTED
    farthest = 0.0
    for _ in range(300):
        station.run(0.1)
        farthest = max(farthest, station.body.north_m * 0.6 + station.body.east_m * 0.8)
    assert math.hypot(station.body.north_m - 60, station.body.east_m - 80) < 0.5
    assert abs(station.body.alt_m - 15) < 0.3
    assert farthest < 101.5
    yaw_deg = math.degrees(station.body.attitude()[2])
    assert yaw_deg == pytest.approx(53.1, abs=5)


def test_go_to_changes_to_guided_only_if_asked_to_and_refuses_nonsense(ground):
    station = ground().take_off()
    station.set_mode(Mode.LOITER)
    x, y = place_e7(station, 10, 0)
    assert station.command_int(GO_TO, -1, 0, x=x, y=y, z=10) == DENIED
    assert station.command_int(GO_TO, -1, 1, x=2**31 - 1, y=y, z=10) == DENIED
    assert station.command_int(GO_TO, -1, 1, x=0, y=0, z=10) == DENIED
    assert station.flight.mode is Mode.LOITER
    assert station.command_int(GO_TO, -1, 1, x=x, y=y, z=10) == ACCEPTED
    assert station.flight.mode is Mode.GUIDED


def test_return_climbs_comes_home_lands_and_disarms(ground):
    station = ground(wind_mps=4, wind_from_deg=90).take_off(10)
    x, y = place_e7(station, 50, -30)
    station.command_int(GO_TO, -1, 1, x=x, y=y, z=10)
    station.run(20)
    assert station.command(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH) == ACCEPTED
    highest = 0.0

    def landed() -> bool:
        nonlocal highest
        highest = max(highest, station.body.alt_m)
        return not station.flight.armed

    station.until(landed, 90)
    assert highest == pytest.approx(15, abs=0.4)
    assert station.from_home_m() < 1.0
    assert station.body.on_ground
    assert station.flight.mode is Mode.RTL


def test_return_from_close_by_climbs_only_the_cone(ground):
    station = ground().take_off(5)
    station.set_mode(Mode.RTL)
    highest = 0.0
    while station.flight.armed:
        station.run(0.2)
        highest = max(highest, station.body.alt_m)
    assert highest < 6


def test_land_goes_straight_down_and_disarms(ground):
    station = ground(wind_mps=3).take_off(8)
    station.set_mode(Mode.LAND)
    fastest_low = 0.0

    def disarmed() -> bool:
        nonlocal fastest_low
        if station.body.alt_m < 3:
            fastest_low = max(fastest_low, station.body.vd_mps)
        return not station.flight.armed

    station.until(disarmed, 40)
    assert station.from_home_m() < 1.0
    assert fastest_low < 0.9


def test_loiter_holds_its_place_in_wind_and_alt_hold_drifts_with_it(ground):
    station = ground(wind_mps=5, wind_from_deg=0).take_off()
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.set_mode(Mode.LOITER)
    station.run(3)
    north, east = station.body.north_m, station.body.east_m
    for _ in range(20):
        station.run(1)
        assert math.hypot(station.body.north_m - north, station.body.east_m - east) < 1.0
    station.set_mode(Mode.ALT_HOLD)
    station.run(10)
    assert station.body.north_m < north - 10  # wind from the north carries it south
    assert abs(station.body.east_m - east) < 8
    assert abs(station.body.alt_m - 10) < 0.3


def test_alt_hold_full_stick_tilts_and_comes_level_within_a_second(ground):
    station = ground().take_off(20)
    station.sticks = station.override(1500, 1000, 1500, 1500)
    station.set_mode(Mode.ALT_HOLD)
    steepest = 0.0
    for _ in range(20):
        station.run(0.1)
        steepest = max(steepest, station.tilt_deg())
    assert 27 <= steepest <= 45
    assert station.body.vn_mps > 5  # stick forward flies forward, to the north here
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.run(1.1)
    assert station.tilt_deg() < 3
    assert abs(station.body.alt_m - 20) < 1


def test_loiter_sticks_move_and_centred_sticks_stop(ground):
    station = ground(heading_deg=90).take_off()
    station.sticks = station.override(1500, 1200, 1500, 1500)
    station.set_mode(Mode.LOITER)
    station.run(4)
    assert station.body.ve_mps > 3
    assert abs(station.body.vn_mps) < 0.5
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.run(8)
    assert station.body.ground_speed_mps() < 0.2


def test_throttle_and_yaw_sticks_climb_descend_and_turn(ground):
    station = ground().take_off()
    station.sticks = station.override(1500, 1500, 2000, 1500)
    station.set_mode(Mode.ALT_HOLD)
    station.run(4)
    assert station.body.vd_mps == pytest.approx(-2.5, abs=0.3)
    station.sticks = station.override(1500, 1500, 1200, 2000)
    station.run(2)
    assert station.body.vd_mps > 0.5
    assert station.body.r_rps > 1.0


def test_stabilize_hovers_about_the_middle_and_falls_with_throttle_down(ground):
    station = ground().take_off(30)
    station.sticks = station.override(1500, 1500, 1515, 1500)
    station.set_mode(Mode.STABILIZE)
    station.run(2)
    assert abs(station.body.vd_mps) < 2
    station.sticks = station.override(1500, 1500, 1000, 1500)
    station.run(1.5)
    assert station.body.vd_mps > 5


def test_brake_stops_and_ignores_sticks(ground):
    station = ground().take_off()
    station.sticks = station.override(1500, 1000, 1500, 1500)
    station.set_mode(Mode.LOITER)
    station.run(5)
    assert station.body.ground_speed_mps() > 5
    station.set_mode(Mode.BRAKE)
    station.run(6)
    assert station.body.ground_speed_mps() < 0.3


def test_circle_keeps_its_radius(ground):
    station = ground().take_off()
    station.sticks = station.override(1500, 1500, 1500, 1500)
    station.set_mode(Mode.CIRCLE)
    station.run(8)
    for _ in range(18):
        station.run(1)
        assert math.hypot(station.body.north_m - 10, station.body.east_m) == pytest.approx(10, abs=1.5)


def test_guided_velocity_lapses_after_three_seconds(ground):
    station = ground().take_off()
    mask = 0b110111000111
    station.send(
        mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, mask, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0)
    )
    station.run(2.5)
    assert station.body.vn_mps == pytest.approx(3, abs=0.5)
    station.run(5)
    assert station.body.ground_speed_mps() < 0.2


def test_guided_position_set_points_local_and_global(ground):
    station = ground().take_off()
    mask = 0b110111111000
    station.send(
        mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, mask, 12, -5, -14, 0, 0, 0, 0, 0, 0, 0, 0)
    )
    station.run(15)
    assert station.body.north_m == pytest.approx(12, abs=0.5)
    assert station.body.east_m == pytest.approx(-5, abs=0.5)
    assert station.body.alt_m == pytest.approx(14, abs=0.3)
    x, y = place_e7(station, 0, 20)
    station.send(
        mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, 6, mask, x, y, 9, 0, 0, 0, 0, 0, 0, 0, 0)
    )
    station.run(20)
    assert station.body.east_m == pytest.approx(20, abs=0.5)
    assert station.body.alt_m == pytest.approx(9, abs=0.3)


def test_pause_speed_and_heading_commands(ground):
    station = ground().take_off()
    x, y = place_e7(station, 100, 0)
    station.command(mavlink.MAV_CMD_DO_CHANGE_SPEED, 1, 3)
    station.command_int(GO_TO, -1, 1, x=x, y=y, z=10)
    station.run(8)
    assert station.body.vn_mps == pytest.approx(3, abs=0.3)
    assert station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0) == ACCEPTED
    station.run(5)
    assert station.body.ground_speed_mps() < 0.2
    assert station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 1) == ACCEPTED
    station.run(5)
    assert station.body.vn_mps > 2
    assert station.command(mavlink.MAV_CMD_CONDITION_YAW, 270) == ACCEPTED
    station.run(8)
    assert math.degrees(station.body.attitude()[2]) == pytest.approx(-90, abs=3)
    station.set_mode(Mode.ALT_HOLD)
    assert station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0) == FAILED


def test_a_go_to_on_the_ground_does_not_take_off(ground):
    station = ground().ready()
    station.set_mode(Mode.GUIDED)
    station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    x, y = place_e7(station, 20, 0)
    station.command_int(GO_TO, -1, 1, x=x, y=y, z=10)
    station.run(5)
    assert station.body.on_ground
    station.run(6)  # DISARM_DELAY with the throttle down
    assert not station.flight.armed


def test_a_weak_motor_is_flown_with(ground):
    station = ground(failures={Failure.MOTOR_WEAK}).take_off()
    station.run(10)
    assert station.from_home_m() < 1.0
    assert abs(station.body.alt_m - 10) < 0.3


def test_home_can_be_moved_and_return_goes_there(ground):
    station = ground().take_off()
    x, y = place_e7(station, 0, 15)
    assert station.command_int(mavlink.MAV_CMD_DO_SET_HOME, 0, x=x, y=y, z=488.0, frame=5) == ACCEPTED
    assert station.command(mavlink.MAV_CMD_GET_HOME_POSITION) == ACCEPTED
    home = station.of("HOME_POSITION")[-1]
    assert (home.latitude, home.longitude) == (x, y)
    station.set_mode(Mode.RTL)
    station.until(lambda: not station.flight.armed, 90)
    assert station.body.east_m == pytest.approx(15, abs=1)
