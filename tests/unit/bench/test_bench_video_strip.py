"""The clock strip as the video benchmark reads it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.video.strip import CELLS, WRAP_MS, Screen, clock_ms, encode, sight

NOW_MS = 1_795_340_000_123


@given(st.integers(0, 1 << 45))
def test_the_clock_comes_back(unix_ms: int) -> None:
    assert clock_ms(encode(unix_ms)) == unix_ms % WRAP_MS


@given(st.integers(0, WRAP_MS - 1), st.integers(0, CELLS - 1))
def test_one_wrong_cell_is_noticed(clock: int, cell: int) -> None:
    assert clock_ms(encode(clock) ^ 1 << cell) is None


@given(st.integers(0, WRAP_MS - 2))
def test_neighbouring_times_differ_in_one_bit_and_their_parity(clock: int) -> None:
    assert (encode(clock) ^ encode(clock + 1)).bit_count() == 3


@pytest.mark.parametrize("age_ms", [-900, 0, 42, 999, 60_000])
def test_the_age_is_told_across_the_wrap(age_ms: int) -> None:
    for at in range(NOW_MS, NOW_MS + WRAP_MS, 4099):
        assert sight(at, (at - age_ms) % WRAP_MS).delay_ms == age_ms


def test_each_picture_counts_once_when_first_seen() -> None:
    screen = Screen()
    screen.take([(NOW_MS + 50, encode(NOW_MS)), (NOW_MS + 66, encode(NOW_MS)), (NOW_MS + 83, encode(NOW_MS + 42))])
    assert [one.delay_ms for one in screen.sights] == [50, 41]
    assert screen.backward == 0


def test_the_same_clock_a_wrap_later_is_another_picture() -> None:
    screen = Screen()
    screen.take([(NOW_MS + 50, encode(NOW_MS)), (NOW_MS + WRAP_MS + 50, encode(NOW_MS + WRAP_MS))])
    assert [one.delay_ms for one in screen.sights] == [50, 50]


def test_what_is_no_strip_and_what_goes_back_is_counted() -> None:
    screen = Screen()
    screen.take([(NOW_MS, 0), (NOW_MS + 60, encode(NOW_MS + 20)), (NOW_MS + 80, encode(NOW_MS))])
    assert (screen.misread, screen.backward) == (1, 1)
    assert len(screen.between(NOW_MS, NOW_MS + 70)) == 1
