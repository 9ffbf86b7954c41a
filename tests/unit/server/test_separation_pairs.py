"""Among many drones no approaching pair is missed: the grid is compared with all pairs."""

from math import cos, radians
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.airspace.core.separation.bounds import SeparationBounds, judge
from server.airspace.core.separation.motion import METRES_PER_DEGREE, Motion, Relative
from server.airspace.core.separation.near_pairs import PAIRS_A_PORTION, Pair, near_pairs
from wire.ids import DroneId

BOUNDS = SeparationBounds(horizontal_m=20.0, vertical_m=10.0, ahead_s=30.0)
NOW = 100.0


def swarm(seed: int, count: int, *, across_m: float, lat_deg: float, lon_deg: float) -> dict[DroneId, Motion]:
    random = Random(seed)
    scale = METRES_PER_DEGREE * cos(radians(lat_deg))
    motions = {}
    for number in range(1, count + 1):
        lon = lon_deg + random.uniform(-across_m, across_m) / scale
        motions[DroneId(number)] = Motion(
            lat_deg + random.uniform(-across_m, across_m) / METRES_PER_DEGREE,
            (lon + 180.0) % 360.0 - 180.0,
            500 + random.uniform(0, 120),
            random.choice((0.0, random.uniform(-20, 20))),
            random.choice((0.0, random.uniform(-20, 20))),
            random.choice((0.0, random.uniform(-3, 3))),
            NOW - random.uniform(0, 3),
        )
    return motions


def found_in(motions: dict[DroneId, Motion], most_pairs: int = 1_000_000) -> list[Pair]:
    return [pair for portion in near_pairs(motions, BOUNDS, NOW, most_pairs=most_pairs) for pair in portion]


@given(
    seed=st.integers(0, 2**32),
    across_m=st.sampled_from([60.0, 400.0, 1500.0]),
    lat_deg=st.sampled_from([0.0, 0.0009, 47.0, -61.2, 70.0]),
    lon_deg=st.sampled_from([0.0, 8.0, 179.9999, -180.0]),
)
def test_no_pair_that_will_conflict_is_missed(seed: int, across_m: float, lat_deg: float, lon_deg: float) -> None:
    motions = swarm(seed, 30, across_m=across_m, lat_deg=lat_deg, lon_deg=lon_deg)
    found = found_in(motions)
    assert len(found) == len(set(found))
    assert all(first < second for first, second in found)
    for first, own in motions.items():
        for second, other in motions.items():
            if first < second and judge(own, other, Relative.of(own, other, NOW), BOUNDS, NOW):
                assert (first, second) in found


def test_drones_far_apart_are_not_looked_at() -> None:
    """Otherwise the grid would save nothing: a thousand drones over ten kilometres make half a million pairs."""
    motions = swarm(1, 1000, across_m=5000, lat_deg=47.0, lon_deg=8.0)
    assert 0 < len(found_in(motions)) < 5000


@pytest.mark.parametrize("most_pairs", [0, 10, 500])
def test_it_stops_where_there_are_too_many(most_pairs: int) -> None:
    same = Motion(47.0, 8.0, 500.0, 0.0, 0.0, 0.0, NOW)
    motions = {DroneId(number): same for number in range(1, 200)}
    assert len(found_in(motions, most_pairs)) == most_pairs


def test_the_work_comes_in_portions() -> None:
    same = Motion(47.0, 8.0, 500.0, 0.0, 0.0, 0.0, NOW)
    motions = {DroneId(number): same for number in range(1, 301)}
    portions = list(near_pairs(motions, BOUNDS, NOW, most_pairs=10_000))
    assert len(portions) > 10
    assert max(map(len, portions)) <= PAIRS_A_PORTION
