"""Whose sticks PX4 obeys, and for how long it sees them move."""

import math

import pytest

from wire.autopilots.px4_sticks import ignores_tower, settles_after_s, uses_receiver

FILTER_S = 0.1
STICKS_EVERY_S = 0.05


def moves_for_s(jump: float, threshold: float, interval_s: float) -> float:
    """How long PX4's filter stays above the threshold after one axis jumped, for sticks at this interval."""
    share = interval_s / (FILTER_S + interval_s)
    change, seconds = share * jump / interval_s, 0.0
    while change > threshold:
        change -= share * change
        seconds += interval_s
    return seconds


@pytest.mark.parametrize("percent", [5.0, 12.0, 30.0, 80.0])
@pytest.mark.parametrize("interval_s", [0.02, STICKS_EVERY_S])
def test_it_waits_until_the_filter_of_the_largest_jump_has_settled(percent: float, interval_s: float) -> None:
    waits_s = settles_after_s({"COM_RC_STICK_OV": percent})
    assert moves_for_s(2.0, percent / 100.0, interval_s) < waits_s < 1.2


def test_the_default_is_that_sticks_override_and_no_wait_is_needed_where_they_do_not() -> None:
    assert settles_after_s({}) == settles_after_s({"COM_RC_OVERRIDE": 3.0, "COM_RC_STICK_OV": 30.0})
    assert settles_after_s({"COM_RC_OVERRIDE": 0.0}) == settles_after_s({"COM_RC_OVERRIDE": 2.0}) == 0.0
    assert math.isfinite(settles_after_s({"COM_RC_STICK_OV": 0.0}))


@pytest.mark.parametrize(
    ("source", "has_radio", "ignored"),
    [
        (None, True, False),
        (0, False, True),
        (1, True, False),
        (2, True, True),
        (3, True, True),
        (3, False, False),
        (3, None, False),
        (4, None, True),
        (5, True, True),
        (6, True, False),
    ],
)
def test_whether_sticks_from_the_tower_move_nothing(source: int | None, has_radio: bool | None, ignored: bool) -> None:
    values = {} if source is None else {"COM_RC_IN_MODE": float(source)}
    assert ignores_tower(values, has_radio) is ignored


@pytest.mark.parametrize(("source", "uses"), [(0, True), (1, False), (2, True), (3, True), (4, False)])
def test_whether_a_receiver_replaces_them(source: int, uses: bool) -> None:
    assert uses_receiver({"COM_RC_IN_MODE": float(source)}) is uses
    assert uses_receiver({})
