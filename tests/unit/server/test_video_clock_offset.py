"""The clock of an agent, estimated from round trips with unequal delays."""

import random

from server.video.core.clock_offset import ANSWERED_WITHIN_S, MAX_OPEN, ClockOffset

AHEAD_US = 7_000_000_000


def ask(clock: ClockOffset, now: float, out_s: float, back_s: float, drift: float = 0.0) -> float:
    """Sends a probe at `now`. Returns the time of its response."""
    number = clock.ask(now)
    there = now + out_s
    assert clock.answered(number, round(there * (1 + drift) * 1e6) + AHEAD_US, there + back_s)
    return there + back_s


def test_nothing_is_known_before_an_answer() -> None:
    clock = ClockOffset()
    assert clock.tower_us(5, 1.0) == 0
    assert clock.offset_us(1.0) is None
    assert clock.error_ms(1.0) is None


def test_the_least_round_trip_counts_however_late_the_others_are() -> None:
    clock, rng, now = ClockOffset(), random.Random(4), 10.0
    for _ in range(20):
        now = ask(clock, now, 0.02, 0.02 + rng.uniform(0.05, 0.8)) + 0.1
    now = ask(clock, now, 0.021, 0.020)
    for _ in range(20):
        now = ask(clock, now, 0.02 + rng.uniform(0.05, 0.8), 0.02) + 0.1
    taken = now - 0.1
    assert abs(clock.tower_us(round(taken * 1e6) + AHEAD_US, now) - taken * 1e6) < 1_000


def test_ten_minutes_of_drift_do_not_add_up() -> None:
    clock, rng, now, worst = ClockOffset(), random.Random(5), 0.0, 0.0
    for _ in range(120):
        after = ask(clock, now, 0.02 + rng.expovariate(50), 0.02 + rng.expovariate(50), drift=50e-6)
        taken_us = round(after * (1 + 50e-6) * 1e6) + AHEAD_US
        worst = max(worst, abs(clock.tower_us(taken_us, after) - after * 1e6) if now > 20 else 0.0)
        now = max(after, now + 5.0)
    assert worst < 15_000


def test_what_is_no_answer_says_nothing() -> None:
    clock = ClockOffset()
    number = clock.ask(1.0)
    assert not clock.answered(number + 1, 0, 1.1)
    assert not clock.answered(number, 0, 1.1 + ANSWERED_WITHIN_S)
    assert not clock.answered(number, 0, 1.1)
    first = clock.ask(2.0)
    for _ in range(MAX_OPEN):
        clock.ask(2.0)
    assert not clock.answered(first, 0, 2.1)
    assert not clock.known


def test_a_time_never_looks_unknown() -> None:
    clock = ClockOffset()
    ask(clock, 0.0, 0.0, 0.0)
    assert clock.tower_us(1, 0.0) == 1
