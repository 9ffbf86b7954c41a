"""Lateness: detects delays beyond the minimum, independent of the one-way delay and of clock differences."""

from hypothesis import given
from hypothesis import strategies as st

from wire.lateness import CLOCK_MS, FORGET_S, WINDOW_S, Lateness, stamp_ms


def test_a_steady_way_is_never_late_however_long_it_is() -> None:
    meter = Lateness()
    assert all(meter.late_by(stamp_ms(7_000 + n * 0.02), n * 0.02 + 0.3) < 0.001 for n in range(500))


def test_what_was_held_up_is_late_by_as_much() -> None:
    meter = Lateness()
    for n in range(50):
        meter.late_by(1000 + n * 20, n * 0.02)
    # A stall of 1 s: the backlog arrives at once, the oldest latest.
    late = [meter.late_by(2000 + n * 20, 2.0) for n in range(50)]
    assert abs(late[0] - 1.0) < 0.001
    assert abs(late[-1] - 0.02) < 0.001


def test_the_clock_may_wrap() -> None:
    meter = Lateness()
    near = CLOCK_MS - 100
    assert [round(meter.late_by((near + n * 20) % CLOCK_MS, n * 0.02), 6) for n in range(20)] == [0.0] * 20


def test_a_way_that_became_longer_is_the_new_measure_after_the_window() -> None:
    meter = Lateness()
    meter.late_by(0, 0.0)
    assert abs(meter.late_by(1000, 1.4) - 0.4) < 0.001
    last = 0.0
    for n in range(2, int(WINDOW_S) + 5):
        last = meter.late_by(n * 1000, n + 0.4)
    assert last < 0.001


def test_what_is_held_up_after_a_long_pause_is_late_all_the_same() -> None:
    meter = Lateness()
    meter.late_by(0, 0.0)
    pause_s = 4 * WINDOW_S
    # Three sent a second apart that arrive together, five seconds after the first was sent.
    late = [meter.late_by(int((pause_s + n) * 1000), pause_s + 5.0) for n in range(3)]
    assert [round(late_s, 3) for late_s in late] == [5.0, 4.0, 3.0]


def test_after_hours_of_silence_the_clocks_are_compared_anew() -> None:
    meter = Lateness()
    meter.late_by(0, 0.0)
    assert meter.late_by(int(FORGET_S * 1000), FORGET_S + 2.0) == 0.0


def test_it_is_never_later_than_what_is_known_otherwise_and_measured_by_that() -> None:
    meter = Lateness()
    meter.late_by(0, 0.0)
    assert meter.late_by(1000, 21.0, at_most_s=0.5) == 0.5
    assert meter.late_by(1100, 21.1, at_most_s=0.02) == 0.02
    assert round(meter.late_by(1200, 21.2, at_most_s=5.0), 3) == 0.02
    assert round(meter.late_by(1300, 21.8, at_most_s=5.0), 3) == 0.52


@given(st.lists(st.tuples(st.integers(0, CLOCK_MS - 1), st.floats(0, 10)), max_size=200))
def test_any_stamps_give_a_lateness_and_bounded_memory(stamps: list[tuple[int, float]]) -> None:
    meter = Lateness()
    now = 0.0
    for stamp, pause in stamps:
        now += pause
        assert meter.late_by(stamp, now) >= 0.0
    assert len(meter._least) <= WINDOW_S + 2
