"""Mission items other than flight: turns, waits, gimbal and photographs; and the same by command."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from simulator.dialect import mavlink
from simulator.geodesy import e7, wrap_pi
from simulator.mission_plan import Item, PlanKind
from simulator.modes import Mode
from simulator.px4.flavour import PX4

ACCEPTED, DENIED, FAILED = 0, 2, 4
HOME_SLOT = Item(16, 0)


def at(station, command: int, north_m: float, east_m: float, alt_m: float = 10.0, *params: float) -> Item:
    place = station.flight.origin.to_place(north_m, east_m, 0)
    four = (*params, *([0.0] * (4 - len(params))))
    return Item(command, 3, (four[0], four[1], four[2], four[3]), e7(place.lat_deg), e7(place.lon_deg), alt_m)


def fly(station, *items: Item) -> None:
    station.flight.plans.store(PlanKind.MISSION, [HOME_SLOT, *items], station.flight.home)
    assert station.set_mode(Mode.AUTO) == ACCEPTED


def reached(station) -> list[int]:
    return [m.seq for m in station.of("MISSION_ITEM_REACHED")]


def until_complete(station, timeout_s: float = 120) -> None:
    station.until(lambda: "Mission complete" in station.texts(), timeout_s)


def heading_to(station, north_m: float, east_m: float) -> float:
    """Returns the error of the heading, degrees."""
    wanted = math.atan2(east_m - station.body.east_m, north_m - station.body.north_m)
    return abs(math.degrees(wrap_pi(station.body.attitude()[2] - wanted)))


@pytest.mark.parametrize(("radius", "sign"), [(12.0, 1), (-12.0, -1)])
def test_turns_are_flown_round_their_place(ground, radius, sign):
    station = ground().take_off()
    fly(station, at(station, 18, 30, 0, 10, 2, 0, radius), at(station, 16, 0, 0))
    turned, last, nearest, farthest = 0.0, None, math.inf, 0.0

    def done() -> bool:
        nonlocal turned, last, nearest, farthest
        body = station.body
        if station.flight.plans.current == 1:
            angle = math.atan2(body.east_m, body.north_m - 30)
            away = math.hypot(body.north_m - 30, body.east_m)
            if away < 13:
                turned += wrap_pi(angle - last) if last is not None else 0.0
                nearest, farthest = min(nearest, away), max(farthest, away)
                last = angle
        return 2 in reached(station)

    station.until(done, 120)
    assert turned * sign == pytest.approx(2 * math.tau, abs=0.6)
    assert nearest > 9.5
    assert farthest < 13


def test_a_loiter_without_end_is_left_only_by_command(ground):
    station = ground().take_off()
    fly(station, at(station, 17, 15, 0), at(station, 16, 0, 0))
    station.run(30)
    assert reached(station) == []
    assert station.body.north_m == pytest.approx(15, abs=0.5)
    station.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    station.until(lambda: reached(station) == [2], 30)


def test_a_delay_holds_back_what_follows_and_not_the_flight(ground):
    """The speed changes three seconds into the leg, not before it."""
    station = ground().take_off()
    fly(
        station,
        at(station, 16, 3, 0),
        Item(112, params=(3.0, 0.0, 0.0, 0.0)),
        Item(178, params=(1.0, 2.0, 0.0, 0.0)),
        at(station, 16, 80, 0),
    )
    station.until(lambda: station.flight.plans.current == 4)
    station.run(2.5)
    assert station.body.ground_speed_mps() > 4
    station.run(5)
    assert station.body.ground_speed_mps() == pytest.approx(2, abs=0.3)
    assert reached(station) == [1]


def test_what_is_not_done_when_the_waypoint_is_reached_is_left_out(ground):
    station = ground().take_off()
    fly(
        station,
        at(station, 16, 3, 0),
        Item(112, params=(60.0, 0.0, 0.0, 0.0)),
        Item(178, params=(1.0, 1.0, 0.0, 0.0)),
        at(station, 16, 10, 0),
        at(station, 16, 40, 0),
    )
    station.until(lambda: reached(station) == [1, 4, 5], 30)


def test_a_distance_holds_back_until_it_is_near(ground):
    station = ground().take_off()
    fly(station, Item(114, params=(20.0, 0.0, 0.0, 0.0)), Item(203, x=1), at(station, 16, 60, 0))
    station.until(lambda: bool(station.of("CAMERA_FEEDBACK")), 60)
    assert station.body.north_m == pytest.approx(40, abs=1)


def test_a_heading_holds_for_the_leg_that_follows(ground):
    station = ground().take_off()
    fly(station, at(station, 16, 3, 0), Item(115, params=(90.0, 0.0, 0.0, 0.0)), at(station, 16, 40, 0, 10, 3))
    station.until(lambda: station.body.north_m > 30, 60)
    assert math.degrees(station.body.attitude()[2]) == pytest.approx(90, abs=3)


def test_a_region_of_interest_is_looked_at_until_it_is_none(ground):
    station = ground().take_off()
    fly(
        station,
        at(station, 195, 20, 40, 0),
        at(station, 16, 40, 0),
        Item(197),
        at(station, 16, 80, 0),
    )
    station.until(lambda: station.body.north_m > 35, 60)
    assert heading_to(station, 20, 40) < 8
    station.until(lambda: station.body.north_m > 70, 60)
    assert heading_to(station, 120, 0) < 8


def test_a_region_of_interest_by_command(ground):
    station = ground().take_off()
    place = station.flight.origin.to_place(0, 50, 0)
    where = {"x": e7(place.lat_deg), "y": e7(place.lon_deg)}
    assert station.command_int(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, **where) == ACCEPTED
    station.run(4)
    assert heading_to(station, 0, 50) < 3
    assert station.command_int(mavlink.MAV_CMD_DO_SET_ROI_LOCATION, x=910_000_000, y=1) == FAILED
    assert station.command(mavlink.MAV_CMD_DO_SET_ROI_NONE) == ACCEPTED
    assert station.flight.roi is None
    station.command_int(mavlink.MAV_CMD_DO_SET_ROI, **where)
    assert station.flight.roi is not None
    assert station.set_mode(Mode.LOITER) == ACCEPTED
    assert station.flight.roi is None  # a change of mode ends it


def test_photographs_every_ten_metres_of_a_leg(ground):
    station = ground().take_off()
    fly(
        station,
        at(station, 16, 1, 0),
        Item(206, params=(10.0, 0.0, 1.0, 0.0)),
        at(station, 16, 52, 0),
        Item(206, params=(0.0, 0.0, 0.0, 0.0)),
        at(station, 16, 90, 0),
    )
    until_complete(station)
    photos = station.of("CAMERA_FEEDBACK")
    north = [station.flight.origin.to_local(m.lat * 1e-7, m.lng * 1e-7)[0] for m in photos]
    gaps = [after - before for before, after in pairwise(north)]
    assert len(photos) in (5, 6)
    assert all(gap == pytest.approx(10, abs=0.3) for gap in gaps)
    assert [m.img_idx for m in photos] == list(range(1, len(photos) + 1))
    assert all(m.alt_rel == pytest.approx(10, abs=0.5) for m in photos)
    assert all(m.alt_msl == pytest.approx(498, abs=0.5) for m in photos)


def test_photographs_by_command(ground):
    station = ground().ready()
    start, stop = mavlink.MAV_CMD_IMAGE_START_CAPTURE, mavlink.MAV_CMD_IMAGE_STOP_CAPTURE
    assert station.command(start, 0, 2, 3) == ACCEPTED
    station.run(10)
    assert len(station.of("CAMERA_FEEDBACK")) == 3
    assert station.command(start, 0, 1, 0) == ACCEPTED
    station.run(4.5)
    assert station.command(stop) == ACCEPTED
    taken = len(station.of("CAMERA_FEEDBACK"))
    assert taken in (7, 8)
    station.run(5)
    assert station.command(mavlink.MAV_CMD_DO_DIGICAM_CONTROL, 0, 0, 0, 0, 1) == ACCEPTED
    assert station.command(mavlink.MAV_CMD_DO_DIGICAM_CONTROL, 0, 0, 0, 0, 0) == ACCEPTED
    assert station.command(start, 0, -1, 1) == DENIED
    assert len(station.of("CAMERA_FEEDBACK")) == taken + 1


def test_what_is_left_at_the_end_is_done_there(ground):
    station = ground().take_off()
    fly(station, at(station, 16, 5, 0), Item(203, x=1))
    until_complete(station)
    assert len(station.of("CAMERA_FEEDBACK")) == 1


def test_a_fence_is_switched_on_by_a_mission(ground):
    station = ground().take_off()
    fly(station, at(station, 16, 5, 0), Item(207, params=(1.0, 0.0, 0.0, 0.0)), at(station, 16, 10, 0))
    until_complete(station)
    assert station.vehicle.parameters["FENCE_ENABLE"] == 1


def test_px4_tells_a_photograph_by_camera_trigger(ground):
    station = ground(flavour=PX4).ready()
    assert station.command(mavlink.MAV_CMD_IMAGE_START_CAPTURE, 0, 1, 1) == ACCEPTED
    station.run(0.2)
    assert [m.seq for m in station.of("CAMERA_TRIGGER")] == [1]
    assert station.of("CAMERA_FEEDBACK") == []
