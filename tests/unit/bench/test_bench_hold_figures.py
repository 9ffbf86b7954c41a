"""Figures read from the tap: each one from a handmade log."""

import math
from types import SimpleNamespace
from typing import Any, cast

import pytest

from bench.hold_figures import figures
from bench.tap import ADMIN, AGENT, OPERATOR, ModeSeen, Motion, Stick, Tap

ALT_HOLD = 2


def log(**parts: Any) -> Tap:
    made = {"sticks": [], "mode_requests": [], "modes": [], "tilts": [], "motions": [], **parts}
    return cast(Tap, SimpleNamespace(**made))


def stick(at: float, who: int, x: int = 0) -> Stick:
    return Stick(at, who, x, 0, 500, 0)


def test_frames_of_the_old_holder_count_from_the_agents_first_act_on() -> None:
    sticks = [stick(9.9, OPERATOR, 1000), stick(10.1, OPERATOR, 1000), stick(10.2, AGENT), stick(10.3, OPERATOR, 1000)]
    tap = log(sticks=[*sticks, stick(10.4, ADMIN)], mode_requests=[9.5, 10.21])
    found = figures(tap, 10.0, OPERATOR, {ALT_HOLD})
    assert found.began_at == 10.21
    assert found.foreign_frames == 1
    assert figures(tap, 10.0, ADMIN, {ALT_HOLD}).foreign_frames == 1


def test_centred_sticks_of_an_earlier_hold_are_no_beginning() -> None:
    sticks = [stick(10.05, AGENT), stick(10.1, ADMIN), stick(10.2, AGENT)]
    assert figures(log(sticks=sticks, mode_requests=[10.2]), 10.0, ADMIN, {ALT_HOLD}).foreign_frames == 0
    assert figures(log(sticks=sticks), 10.0, ADMIN, {ALT_HOLD}).foreign_frames == 1


def test_no_act_of_the_agent_is_no_hold() -> None:
    found = figures(log(sticks=[stick(10.3, OPERATOR)]), 10.0, OPERATOR, {ALT_HOLD})
    assert math.isnan(found.began_at)
    assert found.foreign_frames == -1


def test_the_mode_counts_from_the_trigger_on() -> None:
    seen = [ModeSeen(9.0, ALT_HOLD, True), ModeSeen(10.1, 5, True), ModeSeen(10.4, ALT_HOLD, True)]
    assert figures(log(modes=seen, mode_requests=[10.2]), 10.0, OPERATOR, {ALT_HOLD}).mode_at == 10.4


def test_level_is_when_it_stays_level() -> None:
    tilts = [(10.0, 20.0), (10.5, 3.0), (10.9, 7.0), (11.0, 2.0), (12.0, 1.0)]
    found = figures(log(tilts=tilts, mode_requests=[10.0]), 10.0, OPERATOR, {ALT_HOLD})
    assert found.level_s == pytest.approx(0.9)
    still = figures(log(tilts=[(10.0, 20.0)], mode_requests=[10.0]), 10.0, OPERATOR, {ALT_HOLD})
    assert math.isnan(still.level_s)


def test_height_and_speed() -> None:
    heights = [(10.0, 30.0, 5.0), (11.0, 31.5, 2.0), (13.5, 31.0, 0.4), (15.0, 31.2, 0.3)]
    motions = [Motion(at, alt_m, speed, 0.0, 0.0, 0.0) for at, alt_m, speed in heights]
    found = figures(log(motions=motions, mode_requests=[10.0]), 10.0, OPERATOR, {ALT_HOLD})
    assert found.height_off_m == pytest.approx(1.5)
    assert found.height_unsettled_m == pytest.approx(0.1)
    assert (found.stopped_s, found.speed_end_mps) == (pytest.approx(1.0), 0.3)
