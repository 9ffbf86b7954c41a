"""Wind near the ground: a logarithmic profile below the height for which it is named."""

import random
from math import hypot

import pytest

from simulator.wind import NAMED_AT_M, ROTORS_M, Wind, share_at


def blowing() -> Wind:
    return Wind(8.0, 270.0, random.Random(3))


@pytest.mark.parametrize(("height_m", "share"), [(1_000.0, 1.0), (10.0, 1.0), (5.0, 0.89), (2.0, 0.74), (0.0, 0.38)])
def test_the_share_of_the_named_wind(height_m: float, share: float) -> None:
    assert share_at(height_m) == pytest.approx(share, abs=0.01)


def test_it_never_grows_downwards_and_is_nothing_at_the_ground() -> None:
    shares = [share_at(NAMED_AT_M - 0.1 * step) for step in range(110)]
    assert shares == sorted(shares, reverse=True)
    assert share_at(-ROTORS_M) == 0.0
    assert share_at(-5.0) == 0.0


def test_a_vehicle_near_the_ground_meets_less_of_it_with_its_gusts_and_all_of_a_gust_that_is_wanted() -> None:
    above, below = blowing(), blowing()
    for tenths in range(1, 200):
        high, low = above.at(tenths / 10, 30.0), below.at(tenths / 10, 2.0)
        assert low == pytest.approx(tuple(part * share_at(2.0) for part in high))
    assert hypot(*above.at(20.0)) == hypot(*above.at(20.0, NAMED_AT_M)) > 4.0
    before = below.at(20.0, 2.0)
    below.gust_mps = (0.0, 10.0, 0.0)
    assert below.at(20.0, 2.0)[1] - before[1] == pytest.approx(10.0)


def test_still_air_is_still_at_every_height() -> None:
    assert Wind(0.0, 0.0, random.Random(1)).at(1.0, 1.0) == (0.0, 0.0, 0.0)
