"""The automatic stream profile: fast to reduce, slow to raise, and without oscillation."""

from collections.abc import Callable
from itertools import pairwise

import pytest

from onboard_agent.telemetry.auto_profile import (
    AT_EASE,
    DOWN_AFTER_S,
    FAILED_WITHIN_S,
    MAX_BACKOFF_FACTOR,
    MIN_STAY_S,
    UP_AFTER_S,
    USUAL_OVER_S,
    WORST_FOR,
    AutoProfile,
    Measured,
)
from wire.stream_profiles import StreamProfile

STEP_S = 0.25
FULL, THIN, MINIMAL = StreamProfile.FULL, StreamProfile.THIN, StreamProfile.MINIMAL


class Link:
    def __init__(self) -> None:
        self.auto = AutoProfile()
        self.now = 100.0
        self.changes: list[tuple[float, StreamProfile]] = []

    def run(
        self, seconds: float, *, loss: float = 0.0, rtt_s: float | None = 0.05, loss_now: float = 0.0
    ) -> StreamProfile:
        for _ in range(round(seconds / STEP_S)):
            before = self.auto.profile
            self.auto.measured(Measured(loss, loss_now, rtt_s), self.now)
            if self.auto.profile is not before:
                self.changes.append((self.now, self.auto.profile))
            self.now += STEP_S
        return self.auto.profile

    def until(self, condition: Callable[[], bool], **measured: float) -> float:
        began = self.now
        while not condition():
            assert self.now - began < 1000
            self.run(STEP_S, **measured)
        return self.now - began


@pytest.fixture
def link() -> Link:
    link = Link()
    link.run(10)
    return link


def test_a_good_link_carries_all(link: Link) -> None:
    assert link.run(300, loss=0.05, rtt_s=0.3) is FULL
    assert link.changes == []


def test_a_long_way_is_no_narrow_one() -> None:
    link = Link()
    assert link.run(300, rtt_s=0.7) is FULL


@pytest.mark.parametrize(
    ("loss", "expected"), [(0.0999, FULL), (0.10, THIN), (0.2499, THIN), (0.25, MINIMAL), (1.0, MINIMAL)]
)
def test_so_much_loss_leaves_so_much(link: Link, loss: float, expected: StreamProfile) -> None:
    assert link.run(30, loss=loss) is expected
    assert len(link.changes) <= 1, "straight to what the link carries"


@pytest.mark.parametrize(("loss_now", "expected"), [(0.29, FULL), (0.31, THIN), (0.74, THIN), (0.76, MINIMAL)])
def test_a_sudden_loss_must_be_a_larger_one(link: Link, loss_now: float, expected: StreamProfile) -> None:
    assert link.run(5, loss=0.01, loss_now=loss_now) is expected
    assert expected is FULL or link.auto.why == f"{loss_now:.0%} of the packets are lost"


@pytest.mark.parametrize(("queueing_s", "expected"), [(0.4, FULL), (0.5, THIN), (1.4, THIN), (1.5, MINIMAL)])
def test_so_long_a_queue_leaves_so_much(link: Link, queueing_s: float, expected: StreamProfile) -> None:
    assert link.run(10, rtt_s=0.05 + queueing_s) is expected


def test_down_is_quick_but_one_bad_moment_is_none(link: Link) -> None:
    link.run(DOWN_AFTER_S / 2, rtt_s=9.0)
    assert link.run(5) is FULL
    took_s = link.until(lambda: link.auto.profile is MINIMAL, loss=0.6)
    assert took_s <= DOWN_AFTER_S + 2 * STEP_S
    assert link.auto.why == "60% of the packets are lost"


def test_a_second_step_down_waits_for_what_the_first_has_done(link: Link) -> None:
    link.until(lambda: link.auto.profile is THIN, loss=0.15)
    assert link.until(lambda: link.auto.profile is MINIMAL, loss=0.5) >= MIN_STAY_S - STEP_S
    assert [profile for _, profile in link.changes] == [THIN, MINIMAL]


def test_up_is_slow_and_one_step_at_a_time(link: Link) -> None:
    link.run(5, loss=0.5)
    took_s = link.until(lambda: link.auto.profile is THIN)
    assert UP_AFTER_S <= took_s <= UP_AFTER_S + 2 * STEP_S
    assert link.auto.why == "the link has been at ease for 20 s"
    assert UP_AFTER_S <= link.until(lambda: link.auto.profile is FULL) <= UP_AFTER_S + 2 * STEP_S


def test_between_ease_and_too_much_nothing_changes(link: Link) -> None:
    link.run(5, loss=0.15)
    assert AT_EASE.loss < 0.05 < WORST_FOR[FULL].loss
    assert link.run(600, loss=0.05) is THIN


def test_a_moment_of_unease_begins_the_waiting_anew(link: Link) -> None:
    link.run(5, loss=0.15)
    link.run(UP_AFTER_S - 2)
    link.run(1, loss=0.06)
    assert link.run(UP_AFTER_S - 2) is THIN
    assert link.run(5) is FULL


def test_a_link_with_room_for_thin_only_is_tried_less_and_less_often(link: Link) -> None:
    for _ in range(round(3600 / STEP_S)):
        link.run(STEP_S, loss=0.15 if link.auto.profile is FULL else 0.0)
    tries = [at for at, profile in link.changes if profile is FULL]
    waits = [later - earlier for earlier, later in pairwise(tries)]
    assert waits == sorted(waits)
    assert waits[0] > 2 * UP_AFTER_S
    assert waits[-1] > MAX_BACKOFF_FACTOR * UP_AFTER_S
    assert MINIMAL not in [profile for _, profile in link.changes]


def test_a_failed_try_doubles_the_wait_and_a_good_one_forgives(link: Link) -> None:
    waits = []
    link.run(5, loss=0.15)
    for _ in range(5):
        waits.append(link.until(lambda: link.auto.profile is FULL))
        link.until(lambda: link.auto.profile is THIN, loss=0.15)
    assert [round(wait_s / UP_AFTER_S) for wait_s in waits] == [1, 2, 4, MAX_BACKOFF_FACTOR, MAX_BACKOFF_FACTOR]
    link.until(lambda: link.auto.profile is FULL)
    link.run(FAILED_WITHIN_S + 1)
    link.run(5, loss=0.15)
    assert link.until(lambda: link.auto.profile is FULL) <= UP_AFTER_S + 2 * STEP_S


def test_another_way_becomes_the_usual_one(link: Link) -> None:
    assert link.run(10, rtt_s=0.8) is THIN
    assert link.run(USUAL_OVER_S + UP_AFTER_S, rtt_s=0.8) is FULL


def test_a_new_link_learns_its_way_anew(link: Link) -> None:
    link.auto.new_link()
    assert link.run(30, rtt_s=0.8) is FULL


def test_a_link_that_was_never_answered_is_judged_by_its_loss(link: Link) -> None:
    assert link.run(30, rtt_s=None) is FULL
    assert link.run(30, rtt_s=None, loss=1.0) is MINIMAL
