"""Areas, tracks and crossings: points inside, ways that enter and leave, heights, lines with a width."""

from itertools import pairwise
from math import cos, inf, pi, sin
from random import Random

import pytest

from server.airspace.core.zones.zone import BadZone, check_points, checked
from wire.zones.area import Area, Box, outside
from wire.zones.index import ZoneIndex
from wire.zones.kinds import HeightAbove, ZoneKind, ZoneRule
from wire.zones.track import Spot, Track, crossings, depths
from wire.zones.ways import NEAR_M, crossings_of
from wire.zones.zone import Zone, ZoneShape

M = 1 / 111_319.5
"""Degrees of a metre, at the equator in both directions."""


def at(east_m: float, north_m: float) -> tuple[float, float]:
    return north_m * M, east_m * M


def spot(east_m: float, north_m: float, up_m: float | None = 20.0) -> Spot:
    return Spot(*at(east_m, north_m), up_m, None if up_m is None else up_m + 100)


SQUARE = tuple(at(*corner) for corner in ((0, 0), (100, 0), (100, 100), (0, 100)))
HORSESHOE = tuple(at(*one) for one in ((0, 0), (90, 0), (90, 90), (60, 90), (60, 30), (30, 30), (30, 90), (0, 90)))


def zone(kind: ZoneKind = ZoneKind.NO_FLY, points=SQUARE, width_m: float | None = None, **more: object) -> Zone:
    shape = ZoneShape(points=points, width_m=width_m)
    given = {"id": 1, "name": "Airport", "kind": kind, "rule": ZoneRule.REFUSE, "shape": shape}
    return Zone(**(given | more))


@pytest.mark.parametrize(
    ("place", "inside", "edge_m"),
    [((50, 50), True, 50), ((10, 50), True, 10), ((-20, 50), False, 20), ((103, 104), False, 5), ((99, 1), True, 1)],
)
def test_points_in_an_area(place: tuple[float, float], inside: bool, edge_m: float) -> None:
    area = Area(SQUARE)
    assert area.contains(*at(*place)) is inside
    assert area.edge_m(*at(*place)) == pytest.approx(edge_m, abs=0.1)


@pytest.mark.parametrize(
    ("start", "end", "spans"),
    [
        ((-100, 50), (200, 50), [(1 / 3, 2 / 3)]),
        ((50, 50), (50, 250), [(0, 0.25)]),
        ((-100, 50), (50, 50), [(2 / 3, 1)]),
        ((10, 50), (90, 50), [(0, 1)]),
        ((-50, -10), (150, -10), []),
        ((-50, 150), (150, 150), []),
        ((50, 50), (50, 50), [(0, 1)]),
    ],
)
def test_ways_through_an_area(start: tuple, end: tuple, spans: list) -> None:
    found = Area(SQUARE).spans(at(*start), at(*end))
    assert found == [pytest.approx(one, abs=1e-6) for one in spans]


def test_a_way_through_a_horseshoe_is_inside_twice() -> None:
    spans = Area(HORSESHOE).spans(at(-10, 60), at(100, 60))
    assert [tuple(round(110 * share - 10) for share in one) for one in spans] == [(0, 30), (60, 90)]


def test_a_line_has_a_width_and_round_ends_and_corners() -> None:
    area = Area([at(0, 0), at(100, 0), at(100, 100)], 20)
    assert area.contains(*at(-9, 0))
    assert not area.contains(*at(-8, 8))
    assert area.contains(*at(106, -6))
    assert not area.contains(*at(80, 80))
    assert area.edge_m(*at(50, 4)) == pytest.approx(6, abs=0.1)
    [span] = area.spans(at(-50, 0), at(150, 0))
    assert span == pytest.approx((0.2, 0.8), abs=1e-3)
    [along] = area.spans(at(0, 0), at(100, 0))
    assert along == (0.0, 1.0)
    assert area.spans(at(50, 50), at(50, -50)) == [pytest.approx((0.4, 0.6), abs=1e-3)]


def test_what_is_outside_of_several_spans() -> None:
    assert outside([(0.5, 0.7), (0.0, 0.2), (0.65, 0.8)]) == [(0.2, 0.5), (0.8, 1.0)]
    assert outside([(0.0, 1.0)]) == []
    assert outside([]) == [(0.0, 1.0)]


def test_a_way_over_a_zone_is_free_and_one_that_sinks_into_it_is_not() -> None:
    low = zone(ceiling_m=50.0)
    assert crossings([low], Track(spot(-100, 50, 60), spot(200, 50, 60))) == []
    [one] = crossings([low], Track(spot(50, 50, 60), spot(50, 50, 40)))
    assert one.span == pytest.approx((0.5, 1.0))
    [unknown] = crossings([low], Track(spot(50, 50, None), spot(50, 50, None)))
    assert unknown.starts_there


def test_heights_above_the_sea() -> None:
    low = zone(ceiling_m=110.0, height_above=HeightAbove.SEA)
    assert crossings([low], Track(spot(50, 50, 5), spot(60, 50, 5)))
    assert crossings([low], Track(spot(50, 50, 20), spot(60, 50, 20))) == []


def test_a_height_limit_forbids_what_is_above() -> None:
    limit = zone(ZoneKind.HEIGHT_LIMIT, ceiling_m=50.0)
    assert crossings([limit], Track(spot(50, 50, 40), spot(60, 50, 45))) == []
    [one] = crossings([limit], Track(spot(50, 50, 40), spot(50, 50, 60)))
    assert one.span == pytest.approx((0.5, 1.0))
    assert depths(limit, spot(50, 50, 60)) == pytest.approx((50, 10), abs=0.1)


def test_corridors_together_allow_what_each_allows() -> None:
    east = zone(ZoneKind.CORRIDOR, points=(at(0, 0), at(100, 0)), width_m=20, id=1, name="East")
    north = zone(ZoneKind.CORRIDOR, points=(at(100, 0), at(100, 100)), width_m=20, id=2, name="North")
    assert crossings([east, north], Track(spot(0, 0), spot(100, 0))) == []
    assert crossings([east, north], Track(spot(100, 0), spot(100, 90))) == []
    [short_cut] = crossings([east, north], Track(spot(0, 0), spot(100, 100)))
    assert 0 < short_cut.span[0] < short_cut.span[1] < 1
    [away] = crossings([east], Track(spot(50, 100), spot(50, 200)))
    assert away.zone is east
    assert depths(east, spot(50, 100)) == pytest.approx((90, 0), abs=0.1)


def test_each_team_keeps_its_own_corridors() -> None:
    of_tower = zone(ZoneKind.CORRIDOR, points=(at(0, 0), at(100, 0)), width_m=20, id=1)
    of_team = zone(ZoneKind.CORRIDOR, points=(at(0, 50), at(100, 50)), width_m=20, id=2, team_id=7)
    there = crossings([of_tower, of_team], Track(spot(50, 0), spot(60, 0)))
    assert [one.zone for one in there] == [of_team], "one scope's corridor does not open the other's"


def test_an_unbounded_zone_has_no_way_out_by_height() -> None:
    ground_m, height_m = depths(zone(), spot(50, 50))
    assert (round(ground_m), height_m) == (50, inf)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([(0, 0), (0, 1)], "3 to"),
        ([(0, 0), (0, 0), (0, 0)], "same place"),
        ([(89, 0), (89, 1), (88, 0)], "latitude"),
        ([(0, -179), (0, 179), (1, 0)], "across"),
        ([(0, float("nan")), (0, 1), (1, 0)], "latitude"),
        ([(0, i * 1e-4) for i in range(501)], "500"),
    ],
)
def test_points_that_make_no_zone(points: list, words: str) -> None:
    with pytest.raises(BadZone, match=words):
        check_points(tuple(points), None)


def test_what_makes_no_zone() -> None:
    bow = tuple(at(*one) for one in ((0, 0), (100, 100), (100, 0), (0, 100)))
    for wrong in (
        zone(points=bow),
        zone(floor_m=50.0, ceiling_m=40.0),
        zone(ZoneKind.HEIGHT_LIMIT),
        zone(points=(at(0, 0), at(9, 9)), width_m=0.5),
        zone(reason="two\nlines"),
    ):
        with pytest.raises(BadZone):
            checked(wrong)
    assert checked(zone(name=" Airport ")).name == "Airport"


def test_the_index_finds_what_a_walk_over_all_zones_finds() -> None:
    zones = [
        zone(points=tuple((lat + column / 7, lon + row / 9) for lat, lon in SQUARE), id=10 * row + column + 1)
        for row in range(20)
        for column in range(10)
    ]
    zones.append(zone(points=((0.0, 0.0), (0.0, 1.2), (1.2, 1.2), (1.2, 0.0)), id=900))
    index = ZoneIndex(zones)
    places = [(row / 9 + 3e-4, column / 7 + 3e-4) for row in range(20) for column in range(10)]
    for (lon, lat), (to_lon, to_lat) in pairwise(places):
        box = Track(Spot(lat, lon, 1, 1), Spot(to_lat, to_lon, 1, 1)).box
        expected = {one.id for one in zones if one.area.box.meets(box)}
        assert {one.id for one in index.near(box)} == expected


def test_zones_left_out_for_a_whole_plan_are_entered_by_no_part_of_it() -> None:
    chance = Random(41)
    entered = left_out = 0
    for _ in range(300):
        lat_deg = chance.choice((0.0, 47.0, -79.0))
        zones = [_any_zone(chance, number, lat_deg) for number in range(8)]
        size_deg = chance.choice((0.001, 0.02, 0.2))
        spots = [_any_spot(chance, lat_deg, size_deg) for _ in range(6)]
        lats, lons = [one.lat_deg for one in spots], [one.lon_deg for one in spots]
        box = Box(min(lats), min(lons), max(lats), max(lons)).widened(NEAR_M)
        heights_m = {}
        for above in HeightAbove:
            known = [one.height_m(above) for one in spots if one.height_m(above) is not None]
            heights_m[above] = (min(known), max(known)) if len(known) == len(spots) else (-inf, inf)
        index = ZoneIndex(zones)
        among = index.within(box, heights_m)
        left_out += len(index.zones) - len(among.zones)
        for start, end in pairwise(spots):
            crossed = crossings_of(index, start, end)
            entered += len(crossed)
            assert crossings_of(among, start, end) == crossed
    assert entered > 100 and left_out > 100


def _any_zone(chance: Random, number: int, lat_deg: float) -> Zone:
    middle = lat_deg + chance.uniform(-0.1, 0.1), chance.uniform(-0.1, 0.1)
    reach = chance.choice((0.002, 0.03, 0.3))
    turns = sorted(chance.uniform(0, 2 * pi) for _ in range(chance.randint(3, 9)))
    points = [
        (middle[0] + reach * chance.uniform(0.2, 1) * sin(turn), middle[1] + reach * chance.uniform(0.2, 1) * cos(turn))
        for turn in turns
    ]
    floor_m = chance.choice((None, 0.0, 60.0))
    return zone(
        chance.choice((ZoneKind.NO_FLY, ZoneKind.NO_FLY, ZoneKind.CORRIDOR)),
        tuple(points),
        chance.choice((None, None, 200.0)),
        id=number,
        team_id=chance.choice((None, 1)),
        floor_m=floor_m,
        ceiling_m=chance.choice((None, 80.0)),
        height_above=chance.choice(tuple(HeightAbove)),
    )


def _any_spot(chance: Random, lat_deg: float, size_deg: float) -> Spot:
    up_m = chance.choice((None, 20.0, 70.0, 90.0))
    place = lat_deg + chance.uniform(-size_deg, size_deg), chance.uniform(-size_deg, size_deg)
    return Spot(*place, up_m, None if up_m is None else up_m + chance.choice((0.0, 100.0)))
