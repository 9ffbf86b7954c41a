"""Which motions are plausible: real flight passes, jumps and impossible values do not."""

import random
from math import cos, radians, sin

import pytest

from server.airspace.core.separation.motion import METRES_PER_DEGREE, Motion
from server.airspace.core.separation.plausible import KNOWN_FOR_S, QUARANTINE_S, MotionCheck

STEP_S = 0.5


def motion(
    at: float,
    *,
    north_m: float = 0.0,
    east_m: float = 0.0,
    alt_m: float = 450.0,
    v: tuple[float, float, float] = (0, 0, 0),
) -> Motion:
    lat = 47.0 + north_m / METRES_PER_DEGREE
    return Motion(lat, 8.0 + east_m / (METRES_PER_DEGREE * cos(radians(47.0))), alt_m, *v, at)


def fly(check: MotionCheck, path: list[Motion], *, faster: float = 1.0) -> list[str | None]:
    return [check.why for one in path if check.check(one, one.at * faster, one.at)]


def circle(speed_m_s: float, radius_m: float, for_s: float = 60.0, *, clock: float = 1.0) -> list[Motion]:
    path = []
    for step in range(int(for_s / STEP_S)):
        at = step * STEP_S
        angle = speed_m_s * clock * at / radius_m
        v = (speed_m_s * cos(angle), speed_m_s * sin(angle), 1.0)
        path.append(motion(at, north_m=radius_m * sin(angle), east_m=radius_m * (1 - cos(angle)), alt_m=400 + at, v=v))
    return path


@pytest.mark.parametrize(("speed", "radius"), [(0.01, 10.0), (5, 10), (15, 40), (30, 200), (70, 1000)])
def test_real_flight_is_plausible(speed: float, radius: float) -> None:
    check = MotionCheck()
    assert fly(check, circle(speed, radius)) == []
    assert not check.is_known(KNOWN_FOR_S - 0.1) and check.is_known(KNOWN_FOR_S)


def test_a_simulator_that_flies_eight_times_as_fast_is_plausible_by_its_own_clock() -> None:
    assert fly(MotionCheck(), circle(10, 300, clock=8), faster=8) == []


def test_silence_and_what_comes_after_it_at_once_is_plausible() -> None:
    check = MotionCheck()
    path = [motion(at / 2, north_m=20 * at / 2, v=(20, 0, 0)) for at in range(80)]
    # Ten seconds of positions arrive at once.
    late = [
        (one._replace(at=max(one.at, 20.0) + 0.001 * one.at) if 10 <= one.at <= 20 else one, one.at) for one in path
    ]
    found = [check.why for one, boot_s in late if check.check(one, boot_s, one.at)]
    assert found == []


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"north_m": 500.0}, "jump"),
        ({"alt_m": 1500.0}, "jump"),
        ({"alt_m": 20_000.0}, "height"),
        ({"v": (130.0, 0.0, 0.0)}, "speed"),
        ({"v": (0.0, 0.0, -70.0)}, "speed"),
    ],
)
def test_what_no_machine_does_is_found_and_forgotten_after_a_while(wrong: dict, why: str) -> None:
    check = MotionCheck()
    path = [motion(at * STEP_S) for at in range(40)]
    assert fly(check, path) == []
    assert check.is_known(19.5)
    assert fly(check, [motion(20.0, **wrong)]) == [why]
    assert not check.is_known(20.0)
    stays = {} if why == "speed" else wrong | {"alt_m": min(wrong.get("alt_m", 450.0), 8_000.0)}
    fly(check, [motion(20.5, **stays)])  # back from an impossible position is a jump too
    after = [motion(21.0 + at * STEP_S, **stays) for at in range(int(QUARANTINE_S * 2))]
    assert fly(check, after) == [None]
    assert check.is_known(21.0 + QUARANTINE_S)


def test_one_that_sweeps_its_speed_and_stays_is_found() -> None:
    """It stands still and reports a speed, each time in another direction."""
    check = MotionCheck()
    path = [motion(at, v=(80 * cos(at // 6), 80 * sin(at // 6), 0.0)) for at in range(30)]
    assert fly(check, path)[0] in ("course", "jump")


def test_one_that_creeps_faster_than_it_says_is_found() -> None:
    check = MotionCheck()
    assert fly(check, [motion(at, north_m=40.0 * at, v=(5, 0, 0)) for at in range(30)])[0] in ("course", "jump")


def test_a_clock_that_runs_ahead_does_not_make_any_way_possible() -> None:
    check = MotionCheck()
    path = [motion(at, north_m=250.0 * at, v=(30.0, 0, 0)) for at in range(30)]
    assert fly(check, path, faster=8.3) != []


def test_a_position_that_was_seen_need_not_be_checked_again() -> None:
    """Each position is looked at several times, and changes what was found at the same looks as if all were checked."""
    chance = random.Random(3)
    checked, spared = MotionCheck(), MotionCheck()
    seen: set[str | None] = set()
    spared_looks = 0
    newest, now = motion(0.0), 0.0
    for _ in range(4000):
        now += STEP_S
        if chance.random() < 0.3:
            off_m = chance.choice((0.0, 0.0, 0.0, 0.0, 90_000.0)) if now % 400 < 100 else 0.0
            newest = motion(now, north_m=off_m, v=(chance.choice((0.0, 0.0, 500.0)) if now % 700 < 50 else 0.0, 0, 0))
        changed = checked.check(newest, newest.at, now)
        if spared.is_settled(newest.at):
            spared_looks += 1
            assert not changed
        else:
            assert spared.check(newest, newest.at, now) == changed
        assert spared.why == checked.why
        assert spared.is_known(now) == checked.is_known(now)
        seen.add(checked.why)
    assert {None, "jump", "speed"} <= seen
    assert spared_looks > 1000
