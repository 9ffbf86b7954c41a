"""The tower's zones on board: which directions they refuse, how a flight stops at an edge, and when they count."""

from __future__ import annotations

from typing import Any

import pytest
from controller_world import ControllerWorld
from drone_world import HOME

from onboard_agent.autonomy.controller import Direction, GoBy, GoTo, Hold, Move, TakeOff, Turn, up
from onboard_agent.autonomy.core.lines import DirectionState
from onboard_agent.autonomy.core.local_plane import LocalPlane
from onboard_agent.autonomy.core.position import PositionTrack
from onboard_agent.autonomy.core.safe_commands import HoldGoal, Limits, judge
from onboard_agent.autonomy.core.zone_guard import ZoneGuard
from wire.controllers import ControllerWork
from wire.dialect import mavlink
from wire.zones.kinds import HeightAbove, ZoneKind
from wire.zones.nearby import NearbyZone, NearbyZones

PLANE = LocalPlane(HOME.lat_deg, HOME.lon_deg)
LIMITS = Limits(8.0, 2.0, 60.0, 2000.0)
NOW = 100.0
Corners = tuple[tuple[float, float], ...]
AHEAD: Corners = ((30, -40), (60, -40), (60, 40), (30, 40))
"""30 to 60 m north of home; metres north and east."""
AROUND: Corners = ((-20, -40), (20, -40), (20, 40), (-20, 40))
ONLY_NORTH: Corners = ((-5, -5), (80, -5), (80, 5), (-5, 5))


def near(*zones: NearbyZone, radius_m: float = 5_000.0) -> NearbyZones:
    lat_e7, lon_e7 = round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7)
    return NearbyZones(lat_e7=lat_e7, lon_e7=lon_e7, radius_m=radius_m, zones=zones)


def zone(corners: Corners = AHEAD, kind: ZoneKind = ZoneKind.NO_FLY, **values: Any) -> NearbyZone:
    points = tuple((round(lat * 1e7), round(lon * 1e7)) for lat, lon in (PLANE.on_map(*one) for one in corners))
    return NearbyZone(id=1, name="Airport", kind=kind, points_e7=points, **values)


def to(north_m: float, east_m: float, height_m: float = 10.0) -> GoTo:
    return GoTo(*PLANE.on_map(north_m, east_m), height_m, speed_m_s=5.0)


def guard(*zones: NearbyZone, height_m: float = 10.0, radius_m: float = 5_000.0) -> tuple[ZoneGuard, PositionTrack]:
    """Of a drone that hovers over home, nose north; home is 488 m above the sea."""
    track = PositionTrack()
    place = (round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7))
    heights = (round((488.0 + height_m) * 1000), round(height_m * 1000))
    track.receive(mavlink.MAVLink_global_position_int_message(0, *place, *heights, 0, 0, 0, 0), NOW)
    made = ZoneGuard(track)
    made.told(near(*zones, radius_m=radius_m), NOW)
    return made, track


def words(direction: Direction, *zones: NearbyZone, now: float = NOW, **options: Any) -> str:
    """Returns why the direction is refused; empty: it is not."""
    made, track = guard(*zones, **options)
    assert track.motion is not None
    judged = made.judged(judge(direction, track.motion, PLANE, LIMITS, now), 0.0, now)
    assert (judged.goal is None) == (not judged.bounded and bool(judged.words))
    return judged.words


INTO = "leads into the no-fly zone Airport"


@pytest.mark.parametrize(
    ("direction", "zones", "refused"),
    [
        (to(40, 0), (zone(),), INTO),
        (to(80, 0), (zone(reason="jets"),), f"{INTO} (jets)"),
        (GoBy(forward_m=35), (zone(),), INTO),
        (to(25, 0), (zone(),), ""),
        (to(40, 60), (zone(),), ""),
        (to(40, 0, 25), (zone(ceiling_m=5),), ""),
        (to(40, 0), (zone(floor_m=15),), ""),
        (to(40, 0, 20), (zone(floor_m=15),), INTO),
        (to(40, 0), (zone(floor_m=490, height_above=HeightAbove.SEA),), INTO),
        (to(40, 0), (zone(floor_m=510, height_above=HeightAbove.SEA),), ""),
        (to(40, 0, 20), (zone(kind=ZoneKind.HEIGHT_LIMIT, ceiling_m=15),), "goes above the 15 m above home"),
        (to(40, 0, 14), (zone(kind=ZoneKind.HEIGHT_LIMIT, ceiling_m=15),), ""),
        (to(70, 0), (zone(ONLY_NORTH, ZoneKind.CORRIDOR),), ""),
        (to(70, 30), (zone(ONLY_NORTH, ZoneKind.CORRIDOR),), "leads out of the corridor Airport"),
        (to(40, 0), (zone(((35, -40), (35, 40)), width_m=8),), INTO),
        (to(30, 0), (zone(AROUND),), ""),
        (to(10, 0, 12), (zone(AROUND),), ""),
        (to(0, 0.5), (zone(AROUND),), INTO),
        (to(0, -4), (zone(((-9, -40), (9, -40), (9, 5), (-9, 5))),), INTO),
        (Turn(90), (zone(AROUND),), ""),
        (Hold(), (zone(AROUND),), ""),
        (to(40, 0), (), ""),
    ],
)
def test_which_ways_are_refused(direction: Direction, zones: tuple[NearbyZone, ...], refused: str) -> None:
    assert (refused in words(direction, *zones)) if refused else words(direction, *zones) == ""


def test_a_place_beyond_what_the_tower_told_is_refused() -> None:
    assert "not known on board" in words(to(200, 0), radius_m=150.0)
    assert words(to(100, 0), radius_m=150.0) == ""
    assert words(to(1500, 0), radius_m=0.0) == "", "there are no zones at all"


@pytest.mark.parametrize(("later_s", "counts"), [(0.0, False), (9.9, False), (10.1, True), (19.9, True), (20.1, False)])
def test_a_zone_counts_at_its_time_only(later_s: float, counts: bool) -> None:
    timed = zone(begins_in_s=10.0, ends_in_s=20.0)
    assert (INTO in words(to(40, 0), timed, now=NOW + later_s)) is counts


def test_a_velocity_that_leads_into_a_zone_is_flown_up_to_the_edge_and_the_words_say_so() -> None:
    said = words(Move(forward_m_s=8.0, for_s=5.0), zone())
    assert "stops at the edge" in said
    assert INTO in said
    assert words(Move(forward_m_s=5.0, for_s=5.0), zone()) == ""
    assert words(Move(right_m_s=8.0, for_s=5.0), zone()) == ""


def test_a_climb_is_judged_from_the_ground() -> None:
    made, _ = guard(zone(AROUND, ZoneKind.HEIGHT_LIMIT, ceiling_m=15), height_m=0.0)
    assert "15 m above home of the zone Airport" in made.why_not_up(20.0, NOW)
    assert made.why_not_up(12.0, NOW) == ""


# Flown: the agent's core with a simulated vehicle.


def flying(*zones: NearbyZone) -> ControllerWorld:
    world = ControllerWorld()
    world.onboard.message(near(*zones), world.now)
    world.flies_by_controller(max_distance_m=500.0)
    return world


def state_of(world: ControllerWorld) -> DirectionState:
    return world.script.seen[-1].state


def test_a_drone_stops_in_front_of_a_zone_and_may_fly_away_from_it() -> None:
    world = flying(zone())
    world.script.give.append(to(24, 0))
    world.until(lambda: state_of(world) is DirectionState.DONE, 30.0, "near the zone")
    world.script.give.append(to(40, 0))
    world.run(4.0)
    assert state_of(world) is DirectionState.REFUSED
    assert INTO in world.script.seen[-1].words
    assert world.where[0] < 30.0
    world.script.give.append(to(5, 0))
    world.until(lambda: world.where[0] < 8.0, 20.0, "it flies away")


def test_a_zone_that_is_drawn_in_flight_counts_at_once() -> None:
    world = flying()
    world.script.give.append(to(80, 0))
    world.until(lambda: world.where[0] > 8.0, 20.0, "it is on its way")
    assert state_of(world) is DirectionState.FLYING
    world.onboard.message(near(zone()), world.now)
    world.run(0.3)
    assert state_of(world) is DirectionState.REFUSED
    assert INTO in world.script.seen[-1].words
    world.run(6.0)
    assert world.where[0] < 30.0
    world.onboard.message(near(), world.now)
    world.script.give.append(to(40, 0))
    world.until(lambda: world.where[0] > 35.0, 20.0, "the zone is gone")


@pytest.mark.parametrize("speed_m_s", [2.0, 6.0])
def test_velocities_shrink_towards_the_edge(speed_m_s: float) -> None:
    world = flying(zone(kind=ZoneKind.HEIGHT_LIMIT, ceiling_m=14, corners=AROUND))
    for _ in range(3):
        world.script.give.append(up(speed_m_s, for_s=5.0))
        world.run(5.0)
    assert 12.5 < world.where[2] < 14.3


def test_a_take_off_above_a_height_limit_is_refused_on_the_ground() -> None:
    world = ControllerWorld()
    world.onboard.message(near(zone(AROUND, ZoneKind.HEIGHT_LIMIT, ceiling_m=5)), world.now)
    world.ready()
    world.begin(ControllerWork("survey", may_take_off=True), deadline_s=60.0)
    world.script.give.append(TakeOff(10.0))
    world.until(lambda: bool(world.script.seen) and world.script.seen[-1].number == 1, 10.0, "it is judged")
    assert state_of(world) is DirectionState.REFUSED
    assert "above the 5 m above home of the zone Airport" in world.script.seen[-1].words
    assert not world.vehicle.flight.armed


def test_the_goal_of_a_hold_is_never_barred() -> None:
    made, _ = guard(zone(AROUND))
    assert made.why_not_goal(HoldGoal(), NOW) == ""
