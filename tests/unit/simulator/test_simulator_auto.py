"""AUTO: missions as they are flown."""

from __future__ import annotations

import math

import pytest

from simulator.dialect import mavlink
from simulator.geodesy import e7
from simulator.mission_plan import Item, PlanKind
from simulator.modes import Mode

ACCEPTED, DENIED, FAILED = 0, 2, 4
ARM, START = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_MISSION_START
HOME_SLOT = Item(16, 0)


def at(station, command: int, north_m: float, east_m: float, alt_m: float, *params: float) -> Item:
    place = station.flight.origin.to_place(north_m, east_m, 0)
    four = (*params, *([0.0] * (4 - len(params))))
    return Item(command, 3, (four[0], four[1], four[2], four[3]), e7(place.lat_deg), e7(place.lon_deg), alt_m)


def store(station, *items: Item) -> None:
    station.flight.plans.store(PlanKind.MISSION, [HOME_SLOT, *items], station.flight.home)


def armed_in_guided(station) -> None:
    station.set_mode(Mode.GUIDED)
    assert station.command(ARM, 1) == ACCEPTED


def test_a_whole_mission_from_take_off_to_landing(ground):
    station = ground(wind_mps=3, wind_from_deg=45).ready()
    corners = [(40.0, 0.0), (40.0, 30.0), (0.0, 30.0)]
    store(
        station,
        Item(22, 3, z=12.0),
        *(at(station, 16, n, e, 12) for n, e in corners),
        Item(20),
    )
    armed_in_guided(station)
    assert station.command(START) == ACCEPTED
    nearest = [math.inf] * 3

    def done() -> bool:
        for i, (n, e) in enumerate(corners):
            gap = math.hypot(station.body.north_m - n, station.body.east_m - e)
            nearest[i] = min(nearest[i], gap)
        return not station.flight.armed

    station.until(done, 180)
    assert all(gap < 2.1 for gap in nearest)
    assert [m.seq for m in station.of("MISSION_ITEM_REACHED")] == [1, 2, 3, 4]
    assert station.from_home_m() < 1.0
    assert "Mission: 1 Takeoff" in station.texts()


def test_auto_needs_a_mission_and_on_the_ground_one_that_takes_off(ground):
    station = ground().ready()
    assert station.set_mode(Mode.AUTO) == FAILED
    assert station.command(START, 1, 2) == DENIED
    store(station, at(station, 16, 10, 0, 10))
    armed_in_guided(station)
    assert station.command(START) == FAILED
    assert "Auto: Missing Takeoff Cmd" in station.texts()
    assert station.flight.mode is Mode.GUIDED


def test_auto_cannot_be_armed_in_and_waits_for_a_start(ground):
    station = ground().ready()
    store(station, Item(22, 3, z=10.0), at(station, 16, 10, 0, 10))
    assert station.set_mode(Mode.AUTO) == ACCEPTED
    assert station.command(ARM, 1) == FAILED
    assert "Arm: Auto mode not armable" in station.texts()
    armed_in_guided(station)
    station.set_mode(Mode.AUTO)
    station.run(5)
    assert station.body.on_ground
    station.command(START)
    station.run(8)
    assert station.body.alt_m > 5


def test_a_landing_item_lands_where_it_says(ground):
    station = ground().take_off()
    store(station, at(station, 21, 20, 10, 0))
    station.set_mode(Mode.AUTO)
    station.until(lambda: not station.flight.armed, 90)
    assert math.hypot(station.body.north_m - 20, station.body.east_m - 10) < 1.0


def test_jumps_delays_speed_and_the_end(ground):
    station = ground().take_off()
    store(
        station,
        Item(178, params=(1.0, 2.0, 0.0, 0.0)),
        at(station, 16, 10, 0, 10),
        at(station, 16, 0, 0, 10, 2.0),
        Item(177, params=(2.0, 1.0, 0.0, 0.0)),
        Item(19, 3, (3.0, 0.0, 0.0, 0.0)),
    )
    station.set_mode(Mode.AUTO)
    fastest = 0.0

    def ended() -> bool:
        nonlocal fastest
        fastest = max(fastest, station.body.ground_speed_mps())
        return "Mission complete" in station.texts()

    station.until(ended, 120)
    assert [m.seq for m in station.of("MISSION_ITEM_REACHED")] == [2, 3, 2, 3, 5]
    assert 1.5 < fastest < 2.6
    station.run(5)
    assert station.flight.armed
    assert abs(station.body.alt_m - 10) < 0.5


@pytest.mark.parametrize(("reset", "reached"), [(0, [1, 2, 1, 2, 1, 2]), (1, [1, 2, 1, 2, 1, 2, 1, 2])])
def test_counted_jumps_begin_anew_only_when_that_is_asked_for(ground, reset, reached):
    station = ground().take_off()
    jump = Item(177, params=(1.0, 1.0, 0.0, 0.0))
    store(station, at(station, 16, 6, 0, 10), at(station, 16, 0, 0, 10), jump)
    station.set_mode(Mode.AUTO)
    station.until(lambda: "Mission complete" in station.texts(), 120)
    assert station.command(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, 1, reset) == ACCEPTED
    station.until(lambda: station.texts().count("Mission complete") == 2, 120)
    assert [m.seq for m in station.of("MISSION_ITEM_REACHED")] == reached


def test_a_mission_of_jumps_only_does_not_hang(ground):
    station = ground().take_off()
    store(station, Item(177, params=(2.0, -1.0, 0.0, 0.0)), Item(177, params=(1.0, -1.0, 0.0, 0.0)))
    station.set_mode(Mode.AUTO)
    station.run(1)
    assert abs(station.body.alt_m - 10) < 0.5


def test_pause_set_current_and_upload_in_flight(ground):
    station = ground().take_off()
    store(station, *(at(station, 16, 30 * i, 0, 10) for i in range(1, 5)))
    station.set_mode(Mode.AUTO)
    station.run(3)
    assert station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0) == ACCEPTED
    station.run(5)
    assert station.body.ground_speed_mps() < 0.3
    assert station.command(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, 4) == ACCEPTED
    assert station.command(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, 44) == DENIED
    station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 1)
    station.until(lambda: bool(station.of("MISSION_ITEM_REACHED")), 60)
    assert station.body.north_m > 117
    assert [m.seq for m in station.of("MISSION_ITEM_REACHED")][:1] == [4]
    store(station, at(station, 16, 60, 0, 10), at(station, 17, 100, 20, 10))
    station.command(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, 2)
    station.run(2)
    store(station, at(station, 17, 100, 20, 14), at(station, 16, 0, 0, 14))
    station.run(15)
    assert station.body.alt_m == pytest.approx(14, abs=0.5)
    station.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    station.run(0.1)
    assert station.of("MISSION_ACK")[-1].type == mavlink.MAV_MISSION_ERROR


def test_an_old_set_current_answers_with_mission_current(ground):
    station = ground().ready()
    store(station, Item(22, 3, z=10.0), at(station, 16, 10, 0, 10))
    station.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    station.run(0.1)
    assert station.of("MISSION_CURRENT")[-1].seq == 2
