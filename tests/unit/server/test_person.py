"""Which position fixes from a person's browser count, and the resulting position."""

import math

import pytest

from server.airspace.core.separation.motion import METRES_PER_DEGREE
from server.operations.core.person import ACCURATE_M, FASTEST_M_S, Fix, PersonTrack

FIRST = Fix(47.0, 8.0, 5.0, 100.0)


def north(metres: float, at: float = 101.0, accuracy_m: float = 5.0, **more: float) -> Fix:
    return Fix(47.0 + metres / METRES_PER_DEGREE, 8.0, accuracy_m, at, **more)


def track(away_m: float = 15.0) -> PersonTrack:
    return PersonTrack(FIRST, alt_amsl_m=512.0, away_m=away_m, sign_in=4)


def test_the_person_is_where_the_newest_fix_is_at_the_height_of_the_drone() -> None:
    person = track()
    assert person.motion()[:3] == (47.0, 8.0, 512.0)
    assert person.take(north(3.0), browser=7, sign_in=4) is None
    moved = person.motion()
    assert (moved.lat_deg, moved.alt_amsl_m, moved.at) == (north(3.0).lat_deg, 512.0, 101.0)
    assert (moved.north_m_s, moved.east_m_s, moved.up_m_s) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("away_m", "accuracy_m", "why"),
    [
        (15.0, 15.0, None),
        (15.0, 15.1, "not sure enough"),
        (8.0, 9.0, "not sure enough"),
        (50.0, ACCURATE_M, None),
        (50.0, 20.1, "not sure enough"),
        (50.0, math.nan, "not sure enough"),
    ],
)
def test_a_fix_that_is_not_sure_enough_does_not_count(away_m: float, accuracy_m: float, why: str | None) -> None:
    assert track(away_m).take(north(1.0, accuracy_m=accuracy_m), browser=7, sign_in=4) == why


def test_one_that_is_older_does_not_count_nor_the_same_again() -> None:
    person = track()
    assert person.take(north(1.0, at=100.0), browser=7, sign_in=4) == "older than the last"
    assert person.take(north(1.0), browser=7, sign_in=4) is None
    assert person.take(north(2.0), browser=7, sign_in=4) == "older than the last"


def test_one_that_jumps_does_not_count_and_one_after_a_pause_does() -> None:
    person = track()
    limit_m = FASTEST_M_S + 5.0
    assert person.take(north(limit_m + 0.5), browser=7, sign_in=4) == "too far from the last"
    assert person.motion().lat_deg == 47.0
    assert person.take(north(limit_m - 0.5), browser=7, sign_in=4) is None
    assert person.take(north(limit_m + 20.0, at=103.0), browser=7, sign_in=4) is None


def test_all_come_from_one_browser_of_the_sign_in_that_asked() -> None:
    person = track()
    assert person.take(north(1.0), browser=7, sign_in=5) == "another browser's"
    assert person.browser is None
    assert person.take(north(1.0), browser=7, sign_in=4) is None
    assert person.take(north(2.0, at=102.0), browser=8, sign_in=4) == "another browser's"
    assert person.take(north(2.0, at=102.0), browser=7, sign_in=4) is None


@pytest.mark.parametrize(
    ("speed", "heading", "expected"),
    [(2.0, 90.0, (0.0, 2.0)), (50.0, 0.0, (FASTEST_M_S, 0.0)), (math.nan, 0.0, (0.0, 0.0)), (-3.0, 0.0, (0.0, 0.0))],
)
def test_how_fast_they_go_is_taken_where_it_can_be(speed: float, heading: float, expected: tuple[float, float]) -> None:
    person = track()
    assert person.take(north(1.0, speed_m_s=speed, heading_deg=heading), browser=7, sign_in=4) is None
    moved = person.motion()
    assert (moved.north_m_s, moved.east_m_s) == pytest.approx(expected)
