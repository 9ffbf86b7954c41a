"""Fences that hold, and rally points as return targets."""

from __future__ import annotations

import math

import pytest

from simulator.dialect import mavlink
from simulator.fence import Area, allowed, read_areas
from simulator.geodesy import e7
from simulator.mission_plan import Item, PlanKind
from simulator.modes import Mode
from simulator.px4.flavour import PX4
from simulator.px4.modes import Px4Mode

ACCEPTED, FAILED = 0, 4
REPOSITION, FENCE_ENABLE = mavlink.MAV_CMD_DO_REPOSITION, mavlink.MAV_CMD_DO_FENCE_ENABLE
SQUARE = ((-40.0, -40.0), (-40.0, 40.0), (40.0, 40.0), (40.0, -40.0))


def corner(station, command: int, north_m: float, east_m: float, first: float, alt_m: float = 0.0) -> Item:
    place = station.flight.origin.to_place(north_m, east_m, 0)
    return Item(command, 3, (first, 0.0, 0.0, 0.0), e7(place.lat_deg), e7(place.lon_deg), alt_m)


def polygon(station, command: int, corners) -> list[Item]:
    return [corner(station, command, n, e, len(corners)) for n, e in corners]


def draw(station, *items: Item) -> None:
    station.flight.plans.store(PlanKind.FENCE, list(items), station.flight.home)


def fly_to(station, north_m: float, east_m: float, alt_m: float = 10.0) -> int | None:
    place = station.flight.origin.to_place(north_m, east_m, 0)
    at = {"x": e7(place.lat_deg), "y": e7(place.lon_deg), "z": alt_m}
    return station.command_int(REPOSITION, -1, 1, **at, frame=6)


def fly_on(station, vn: float, ve: float = 0.0, climb: float = 0.0) -> None:
    """Sends a velocity set-point, which no fence stops."""
    mask = 0b110111000111
    station.send(
        mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, mask, 0, 0, 0, vn, ve, -climb, 0, 0, 0, 0, 0)
    )


def until_breached(station, vn: float = 0.0, ve: float = 0.0, climb: float = 0.0) -> None:
    def breached() -> bool:
        fly_on(station, vn, ve, climb)
        return any(text.endswith("fence breached") for text in station.texts())

    station.until(breached, 60)


def fence_status(station):
    station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 162)
    return station.of("FENCE_STATUS")[-1]


@pytest.mark.parametrize(
    ("point", "inside"),
    [((0, 0), True), ((39, 39), True), ((41, 0), False), ((0, -41), False), ((10, 10), True), ((-50, -50), False)],
)
def test_a_polygon_contains_what_lies_in_it(point, inside):
    assert Area(SQUARE, inclusion=True).contains(point) is inside


def test_a_polygon_that_is_not_convex():
    """A square with a notch in its east side."""
    bitten = Area(((0, 0), (0, 10), (4, 10), (5, 2), (6, 10), (10, 10), (10, 0)), inclusion=True)
    assert bitten.contains((5, 1))
    assert not bitten.contains((5, 5))


def test_inclusions_and_exclusions_together():
    west, east = Area(SQUARE, True), Area(((0.0, 30.0),), True, 30.0)
    hole = Area(((0.0, 0.0),), False, 5.0)
    areas = (west, east, hole)
    assert allowed(areas, (0, 20), any_inclusion=False)
    assert not allowed(areas, (0, -20), any_inclusion=False)
    assert allowed(areas, (0, -20), any_inclusion=True)
    assert not allowed(areas, (0, 3), any_inclusion=True)
    assert allowed((), (0, 0), any_inclusion=False)


def test_areas_are_read_from_items_and_a_broken_one_is_told(ground):
    station = ground().ready()
    to_local = station.flight.origin.to_local
    items = [
        *polygon(station, 5001, SQUARE),
        corner(station, 5004, 5, 5, 12.0),
        *polygon(station, 5002, SQUARE[:3]),
        *polygon(station, 5002, SQUARE[1:]),
    ]
    areas, whole = read_areas(items, to_local)
    assert whole
    assert [(len(a.corners), a.inclusion, a.radius_m) for a in areas] == [
        (4, True, None),
        (1, False, 12.0),
        (3, False, None),
        (3, False, None),
    ]
    for broken in (items[:3], [corner(station, 5001, 0, 0, 2), corner(station, 5001, 1, 1, 2)]):
        assert read_areas(broken, to_local) == ((), False)


def test_a_fence_that_is_not_enabled_holds_nobody(ground):
    station = ground().take_off()
    draw(station, corner(station, 5003, 0, 0, 20.0))
    assert fly_to(station, 60, 0) == ACCEPTED
    station.until(lambda: station.body.north_m > 58, 60)
    assert station.flight.mode is Mode.GUIDED
    assert fence_status(station).breach_status == 0


@pytest.mark.parametrize(
    ("parameters", "way", "name", "kind"),
    [
        ({"FENCE_RADIUS": 30}, {"vn": 5}, "Circle", 3),
        ({"FENCE_ALT_MAX": 20}, {"climb": 2}, "Max Alt", 2),
        ({"FENCE_TYPE": 15, "FENCE_ALT_MIN": 5}, {"climb": -1}, "Min Alt", 1),
    ],
)
def test_a_breach_is_told_and_returns_to_launch(ground, parameters, way, name, kind):
    station = ground(parameters={"FENCE_ENABLE": 1, **parameters}).take_off()
    assert fence_status(station).breach_status == 0
    until_breached(station, **way)
    assert f"{name} fence breached" in station.texts()
    assert station.flight.mode is Mode.RTL
    status = fence_status(station)
    assert (status.breach_status, status.breach_count, status.breach_type) == (1, 1, kind)
    assert status.breach_time == pytest.approx(station.now_s * 1000, abs=1000)
    station.until(lambda: f"{name} fence breach cleared" in station.texts(), 60)
    assert fence_status(station).breach_status == 0
    station.until(lambda: not station.flight.armed, 120)
    assert station.from_home_m() < 1.5


@pytest.mark.parametrize(
    ("items", "way"),
    [
        (lambda s: polygon(s, 5001, SQUARE), {"vn": 5}),
        (lambda s: [corner(s, 5003, 0, 0, 30.0)], {"ve": -5}),
        (lambda s: polygon(s, 5002, ((20, -20), (20, 20), (60, 0))), {"vn": 5}),
        (lambda s: [corner(s, 5004, 0, 40, 15.0)], {"ve": 5}),
    ],
)
def test_what_was_drawn_holds(ground, items, way):
    station = ground(parameters={"FENCE_ENABLE": 1}).take_off()
    draw(station, *items(station))
    until_breached(station, **way)
    assert "Polygon fence breached" in station.texts()
    assert station.flight.mode is Mode.RTL
    assert fence_status(station).breach_type == mavlink.FENCE_BREACH_BOUNDARY
    assert 15 < station.from_home_m() < 45


@pytest.mark.parametrize(
    ("action", "mode"),
    [(0, Mode.GUIDED), (1, Mode.RTL), (2, Mode.LAND), (3, Mode.RTL), (4, Mode.BRAKE), (5, Mode.LAND)],
)
def test_the_action_is_configured(ground, action, mode):
    station = ground(parameters={"FENCE_ENABLE": 1, "FENCE_RADIUS": 15, "FENCE_ACTION": action}).take_off()
    until_breached(station, vn=4)
    assert station.flight.mode is mode


@pytest.mark.parametrize(("options", "result"), [(1, FAILED), (0, ACCEPTED)])
def test_the_mode_is_kept_while_it_is_outside(ground, options, result):
    parameters = {"FENCE_ENABLE": 1, "FENCE_RADIUS": 15, "FENCE_OPTIONS": options}
    station = ground(parameters=parameters).take_off()
    until_breached(station, vn=4)
    assert station.set_mode(Mode.LOITER) == result
    assert ("Mode change to LOITER failed: in fence recovery" in station.texts()) is (result == FAILED)
    station.set_mode(Mode.RTL)
    station.until(lambda: "Circle fence breach cleared" in station.texts(), 60)
    assert station.set_mode(Mode.LOITER) == ACCEPTED


def test_a_landing_is_no_breach_of_the_floor(ground):
    station = ground(parameters={"FENCE_ENABLE": 1, "FENCE_TYPE": 8, "FENCE_ALT_MIN": 5}).take_off()
    station.set_mode(Mode.LAND)
    station.until(lambda: not station.flight.armed, 60)
    assert fence_status(station).breach_count == 0


def test_it_acts_again_twenty_metres_farther_out(ground):
    parameters = {"FENCE_ENABLE": 1, "FENCE_RADIUS": 15, "FENCE_OPTIONS": 0}
    station = ground(parameters=parameters).take_off()
    until_breached(station, vn=5)
    assert station.set_mode(Mode.GUIDED) == ACCEPTED

    def again() -> bool:
        fly_on(station, 5)
        return station.flight.mode is Mode.RTL

    station.until(again, 30)
    assert 34 < station.body.north_m < 38
    assert fence_status(station).breach_count == 2


def test_a_place_outside_is_refused_as_a_destination(ground):
    station = ground(parameters={"FENCE_ENABLE": 1, "FENCE_RADIUS": 50, "FENCE_ALT_MAX": 30}).take_off()
    assert fly_to(station, 60, 0) == FAILED
    assert fly_to(station, 0, 0, 31) == FAILED
    assert fly_to(station, 40, 0, 29) == ACCEPTED


def test_arming_outside_or_with_a_broken_fence_is_refused(ground):
    station = ground(parameters={"FENCE_ENABLE": 1}).ready()
    station.set_mode(Mode.GUIDED)
    arm = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
    draw(station, corner(station, 5003, 200, 0, 50.0))
    assert station.command(arm, 1) == FAILED
    assert "Arm: vehicle outside Polygon fence" in station.texts()
    draw(station, *polygon(station, 5001, SQUARE)[:3])
    assert station.command(arm, 1) == FAILED
    assert "Arm: Polygon fence(s) invalid" in station.texts()
    draw(station, *polygon(station, 5001, SQUARE))
    assert station.command(arm, 1) == ACCEPTED


def test_the_fence_is_switched_by_command_and_told_in_the_system_status(ground):
    station = ground().ready()

    def geofence() -> bool:
        station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 1)
        return bool(station.of("SYS_STATUS")[-1].onboard_control_sensors_present & mavlink.MAV_SYS_STATUS_GEOFENCE)

    assert not geofence()
    assert station.command(FENCE_ENABLE, 1) == ACCEPTED
    assert station.vehicle.parameters["FENCE_ENABLE"] == 1
    assert geofence()
    assert station.command(FENCE_ENABLE, 7) == FAILED
    assert station.command(FENCE_ENABLE, 0) == ACCEPTED
    assert not geofence()


def rally(station, *places: tuple[float, float, float]) -> None:
    items = [corner(station, 5100, n, e, 0.0, alt) for n, e, alt in places]
    station.flight.plans.store(PlanKind.RALLY, items, station.flight.home)


@pytest.mark.parametrize(
    ("parameters", "goal"),
    [
        ({}, (80, 20)),
        ({"RALLY_LIMIT_KM": 0.01}, (0, 0)),
        ({"RALLY_LIMIT_KM": 0}, (80, 20)),
        ({"RTL_ALT": 3000}, (80, 20)),
    ],
)
def test_a_return_ends_at_the_nearest_rally_point(ground, parameters, goal):
    station = ground(parameters=parameters).take_off()
    rally(station, (80, 20, 22), (-90, 0, 22))
    fly_to(station, 60, 0)
    station.until(lambda: station.body.north_m > 58, 60)
    station.set_mode(Mode.RTL)
    highest = 0.0

    def down() -> bool:
        nonlocal highest
        highest = max(highest, station.body.alt_m)
        return not station.flight.armed

    station.until(down, 180)
    assert math.dist((station.body.north_m, station.body.east_m), goal) < 1.5
    assert highest == pytest.approx(15 if goal == (0, 0) else 22, abs=0.6)


def test_home_counts_as_a_rally_point_only_if_it_is_to(ground):
    ended = []
    for include_home in (1, 0):
        station = ground(parameters={"RALLY_INCL_HOME": include_home}).take_off()
        rally(station, (60, 0, 15))
        station.set_mode(Mode.RTL)
        station.until(lambda station=station: not station.flight.armed, 120)
        ended.append(round(station.body.north_m / 10) * 10)
    assert ended == [0, 60]


def px4_in_the_air(ground, **options):
    station = ground(flavour=PX4, **options).ready()
    flight = station.flight
    assert station.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, float("nan"), 0, 0, 498) == ACCEPTED
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED
    station.until(lambda: flight.mode is Px4Mode.LOITER and not flight.landed, 60)
    return station


@pytest.mark.parametrize(("action", "mode"), [(1, None), (2, Px4Mode.LOITER), (3, Px4Mode.RTL), (5, Px4Mode.LAND)])
def test_px4_breaches(ground, action, mode):
    station = px4_in_the_air(ground, parameters={"GF_ACTION": action, "GF_MAX_HOR_DIST": 20})
    station.flight.set_mode(Px4Mode.OFFBOARD)
    until_breached(station, vn=4)
    assert "Circle fence breached" in station.texts()
    assert station.flight.mode is (mode or Px4Mode.OFFBOARD)


def test_px4_does_not_take_off_outside_of_what_was_drawn(ground):
    station = ground(flavour=PX4).ready()
    draw(station, corner(station, 5003, 200, 0, 50.0))
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "Preflight Fail: vehicle outside Polygon fence" in station.texts()
