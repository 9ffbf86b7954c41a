"""Missions into the ground: which are refused, and in which words."""

from collections.abc import Sequence
from math import exp

import pytest

from server.plans.core.ground_check import (
    Heights,
    IntoTheGround,
    Lowest,
    Origin,
    lowest_leg,
    refuse_into_the_ground,
)
from wire.plans import PlanItem

HOME = Origin(47.4, 8.5, 412.0)  # its receiver is wrong by 12 m
WAYPOINT, TAKE_OFF, LAND, RETURN = 16, 22, 21, 20


def north_m(lat_deg: float) -> float:
    return (lat_deg - HOME.lat_deg) * 111_319.49


def ridge(places: Sequence[tuple[float, float]]) -> list[float | None]:
    """60 m high, its top 300 m north of home; nothing is known beyond 2 km."""
    return [
        400.0 + 60.0 * exp(-(((north_m(lat) - 300.0) / 80.0) ** 2)) if north_m(lat) < 2_000 else None
        for lat, _ in places
    ]


def at(north: float, z: float, frame: int = 3, command: int = WAYPOINT) -> PlanItem:
    return PlanItem(command, frame, x=round((HOME.lat_deg + north / 111_319.49) * 1e7), y=85_000_000, z=z)


UP = PlanItem(TAKE_OFF, z=30.0)


@pytest.mark.parametrize(
    ("items", "expected"),
    [
        ((UP, at(600, 30)), (1, -30)),
        ((UP, at(600, 442, 0)), (1, -30)),
        ((UP, at(100, 30), at(300, 64), at(600, 30)), (2, 3)),
        ((UP, at(300, 9, 10)), None),
        ((UP, at(300, 4, 10)), (1, 4)),
        ((UP, at(20, 30, 10), at(600, 30, 11)), None),
        ((UP, at(20, 80), at(600, 80)), None),
        ((UP, at(600, 0, 3, LAND)), (1, -30)),
        ((UP, at(100, 30), at(100, 0, 3, LAND)), None),
        ((UP, at(100, 30), PlanItem(RETURN)), None),
        ((UP, at(5_000, 30, 3)), (1, -30)),
        ((), None),
    ],
)
def test_the_first_leg_that_is_too_low_is_found(items: tuple[PlanItem, ...], expected: tuple[int, int] | None) -> None:
    found = lowest_leg(items, HOME, ridge, 5.0)
    assert (found and (found.item, round(found.above_ground_m))) == expected


@pytest.mark.parametrize(("home", "heights"), [(None, ridge), (HOME, lambda places: [None for _ in places])])
def test_what_is_not_known_is_not_judged(home: Origin | None, heights: Heights) -> None:
    assert lowest_leg((UP, at(600, 30)), home, heights, 5.0) is None


def test_the_refusal_names_drone_item_and_heights() -> None:
    with pytest.raises(IntoTheGround) as refused:
        refuse_into_the_ground("Merlin", (UP, at(600, 30)), HOME, ridge, 5.0)
    assert (
        refused.value.message == "the way of Merlin to item 2 is 30 m below the ground; 5 m is the least on this tower"
    )
    assert refused.value.item == 1
    assert lowest_leg((UP, at(300, 62)), HOME, ridge, 5.0) == Lowest(1, pytest.approx(1.9, abs=0.1))


def test_a_long_mission_is_looked_at_in_wider_steps() -> None:
    asked = 0

    def counted(places: Sequence[tuple[float, float]]) -> list[float | None]:
        nonlocal asked
        asked += len(places)
        return [400.0 for _ in places]

    assert lowest_leg(tuple(at(900_000.0 * (n % 2), 50) for n in range(700)), HOME, counted, 5.0) is None
    assert 15_000 < asked < 25_000
