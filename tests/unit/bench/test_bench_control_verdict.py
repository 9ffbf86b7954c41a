"""The verdict on a flight: what counts as sinking, and what as announced in advance."""

import math
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from bench.control_verdict import PX4, Announcement, Record, announces, judge
from bench.tap import ModeSeen, Motion, Stick

ALT_HOLD, AUTO, LOITER, RTL, LAND, BRAKE = 2, 3, 5, 6, 9, 17
OPEN = {"phase": "quiet", "action": None, "after_sticks": "stays"}
COUNTING = {"phase": "counting", "action": "return", "after_sticks": "unknown"}


def straight(until_s: float, alt_m: float, climb_mps: float = 0.0, since_s: float = 0.0) -> list[Motion]:
    """Motions at 10 Hz from `since_s`; ends on the ground."""
    found = []
    for number in range(round((until_s - since_s) * 10)):
        height = alt_m + climb_mps * number / 10
        found.append(Motion(since_s + number / 10, max(height, 0.0), 0.0, climb_mps if height > 0 else 0.0, 0.0, 0.0))
    return found


def flight(
    motions: list[Motion], *modes: tuple[float, int], reported: tuple[Announcement, ...] = (), **more: Any
) -> Record:
    """By hand in LOITER first; the trigger is at 0."""
    seen = [ModeSeen(at, mode, True) for at, mode in ((-1.0, LOITER), *modes)]
    present = frozenset({"admin"})
    sticks, present = more.pop("sticks", ()), more.pop("present", present)
    reported = (Announcement(0.1, "admin", OPEN), *reported)
    return Record(0.0, motions, seen, sticks, reported, (0.01, 1.4), present, 1, **more)


def test_a_drone_that_stays_is_well() -> None:
    verdict = judge(flight(straight(120, 25), (0.03, ALT_HOLD), (1.5, BRAKE)))
    assert verdict.wrong == ()
    assert (verdict.held_s, verdict.stays_s) == (0.03, 1.5)
    assert math.isnan(verdict.returned_s)


def test_sinking_in_a_hold_is_wrong() -> None:
    motions = straight(33, 25) + straight(50, 25, -2.5, since_s=33)
    (words,) = judge(flight(motions, (0.03, ALT_HOLD))).wrong
    assert "sank" in words and "ALT_HOLD" in words


def test_the_ground_counts_before_anything_has_settled() -> None:
    (words,) = judge(flight(straight(4, 5, -2.5), (0.03, ALT_HOLD))).wrong
    assert "hit the ground at 2.5 m/s" in words


def test_what_a_descent_still_sinks_while_it_is_stopped_is_well() -> None:
    motions = straight(2, 20, -2.0) + straight(120, 16, since_s=2)
    assert judge(flight(motions, (0.03, ALT_HOLD), (1.5, BRAKE))).wrong == ()


def test_a_return_that_was_announced_before_is_well() -> None:
    motions = straight(30, 25) + straight(60, 25, -1.0, since_s=30)
    verdict = judge(flight(motions, (0.03, ALT_HOLD), (30.0, RTL), reported=(Announcement(1.0, "admin", COUNTING),)))
    assert verdict.wrong == ()
    assert (verdict.announced_s, verdict.returned_s) == (1.0, 30.0)


@pytest.mark.parametrize(
    "reported", [(), (Announcement(31.0, "admin", COUNTING),), (Announcement(1.0, "operator", COUNTING),)]
)
def test_a_return_that_nobody_present_was_told_of_before_is_wrong(reported: tuple[Announcement, ...]) -> None:
    motions = straight(30, 25) + straight(60, 25, -1.0, since_s=30)
    assert judge(flight(motions, (0.03, ALT_HOLD), (30.0, RTL), reported=reported)).wrong == (
        "admin was not told of the RTL",
    )


def test_without_a_tower_what_stood_there_before_is_the_announcement() -> None:
    motions = straight(30, 25) + straight(60, 25, -1.0, since_s=30)
    assert judge(flight(motions, (0.5, ALT_HOLD), (30.0, RTL), present=frozenset(), standing=True)).wrong == ()
    assert judge(flight(motions, (0.5, ALT_HOLD), (30.0, RTL), present=frozenset())).wrong


def test_a_countdown_that_was_taken_back_announces_nothing() -> None:
    motions = straight(30, 25) + straight(60, 25, -1.0, since_s=30)
    reported = (Announcement(1.0, "admin", COUNTING), Announcement(2.0, "admin", None))
    assert judge(flight(motions, (0.03, ALT_HOLD), (30.0, RTL), reported=reported)).wrong == (
        "admin was not told of the RTL",
    )


def test_a_drone_that_waits_and_nobody_is_told_is_wrong() -> None:
    reported = (Announcement(1.0, "admin", COUNTING), Announcement(2.0, "admin", None))
    found = judge(flight(straight(120, 25), (0.03, ALT_HOLD), (1.5, BRAKE), reported=reported)).wrong
    assert found == ("waits in BRAKE, and admin is not told of a hold",)


def test_a_return_that_goes_on_needs_no_announcement() -> None:
    seen = [ModeSeen(-1.0, RTL, True), ModeSeen(1.0, RTL, True)]
    record = Record(0.0, straight(60, 20, -0.5), seen, (), (), (), frozenset({"admin"}), 1)
    assert judge(record).wrong == ()


def test_a_return_that_was_interrupted_and_began_again_is_announced_anew() -> None:
    seen = [ModeSeen(at, mode, True) for at, mode in ((-1.0, RTL), (0.1, ALT_HOLD), (30.0, LAND))]
    record = Record(0.0, straight(60, 20), seen, (), (), (), frozenset({"admin"}), 1)
    assert judge(record).wrong == ("admin was not told of the LAND",)


def test_sticks_of_the_old_holder_after_the_hold_are_counted() -> None:
    sticks = [Stick(at, who, 0, 0, 1000, 0) for at, who in ((-0.1, 1), (0.1, 1), (0.2, 0), (0.3, 1))]
    assert judge(flight(straight(10, 25), (0.2, ALT_HOLD), sticks=sticks)).foreign_frames == 1


def test_a_flight_that_was_over_before_it_began_says_nothing() -> None:
    assert judge(flight(straight(10, 0.1), (0.03, ALT_HOLD))).wrong == (
        "it was not in the air when its pilot was lost",
    )


def test_a_hold_in_the_mode_that_was_flown_began_when_it_was_asked_for() -> None:
    seen = [ModeSeen(at, ALT_HOLD, True) for at in (-1.0, 0.2, 0.6)]
    record = Record(
        0.0, straight(10, 25), seen, (), (Announcement(0.1, "admin", OPEN),), (0.5,), frozenset({"admin"}), 1
    )
    assert judge(record).held_s == 0.6


@pytest.mark.parametrize(
    ("hold", "reported"),
    [
        (None, False),
        ({"phase": "quiet", "action": None, "after_sticks": "stays"}, False),
        ({"phase": "quiet", "action": None, "after_sticks": "sinks"}, False),
        ({"phase": "quiet", "action": None, "after_sticks": "returns"}, True),
        ({"phase": "stayed", "action": "stay", "after_sticks": "stays"}, False),
        (COUNTING, True),
        ({"phase": "asking", "action": "land", "after_sticks": "stays"}, True),
    ],
)
def test_what_announces_a_descent(hold: dict[str, Any] | None, reported: bool) -> None:
    assert announces(hold) is reported


@pytest.mark.parametrize(("due_s", "wrong"), [(30.0, 0), (32.5, 0), (45.0, 1), (20.0, 1)])
def test_a_return_at_another_moment_than_the_announced_one_is_wrong(due_s: float, wrong: int) -> None:
    as_of = datetime(2026, 1, 1, tzinfo=UTC)
    hold = COUNTING | {"as_of": as_of.isoformat(), "due_at": (as_of + timedelta(seconds=due_s - 2.0)).isoformat()}
    motions = straight(30, 25) + straight(60, 25, -1.0, since_s=30)
    told = (Announcement(2.0, "admin", hold),)
    record = flight(motions, (0.03, ALT_HOLD), (1.5, BRAKE), (30.0, RTL), reported=told)
    assert len(judge(record).wrong) == wrong


def test_a_px4_is_judged_by_its_own_modes() -> None:
    loiter, landing = 4 << 16 | 3 << 24, 4 << 16 | 6 << 24
    sinking = straight(20, 25) + straight(30, 25, -2.5, since_s=20)
    (words,) = judge(flight(sinking, (0.03, loiter), table=PX4)).wrong
    assert words.endswith("in AUTO.LOITER")
    (words,) = judge(flight(sinking, (0.03, loiter), (20.0, landing), table=PX4)).wrong
    assert words == "admin was not told of the AUTO.LAND"


@pytest.mark.parametrize(("has_agent", "wrong"), [(True, 1), (False, 0)])
def test_nobody_tells_of_a_hold_without_an_agent(has_agent: bool, wrong: int) -> None:
    told = (Announcement(0.2, "admin", None),)
    record = flight(straight(120, 25), (0.03, ALT_HOLD), (1.5, BRAKE), reported=told, has_agent=has_agent)
    assert len(judge(record).wrong) == wrong


def test_a_hold_that_flies_on_is_wrong() -> None:
    still = straight(60, 25)
    motions = [Motion(one.at, one.alt_m, 5.0, 0.0, 5.0 * max(one.at - 1.5, 0.0), 0.0) for one in still]
    (words,) = judge(flight(motions, (0.03, ALT_HOLD), (1.5, BRAKE))).wrong
    assert words.endswith("m away in a hold that stays")
