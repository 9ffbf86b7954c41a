"""The outbox of one browser: bounded, newest state first, and transactional frames never dropped silently."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.link.core.outbox import MAX_STATE_KINDS, MAX_TRANSACTIONAL, Outbox
from wire.ids import DroneId

ONE, TWO = DroneId(1), DroneId(2)
ATTITUDE = (1, 1, 30, 0)
POSITION = (1, 1, 33, 0)


def test_of_watched_state_only_the_newest_goes_out_and_only_at_the_beat() -> None:
    box = Outbox(0.0)
    assert box.offer(ONE, ATTITUDE, b"a1")
    assert box.take(0.0) == [b"a1"]
    assert box.offer(ONE, ATTITUDE, b"a2")
    assert not box.offer(ONE, ATTITUDE, b"a3")
    assert box.take(0.1) == []
    assert box.next_beat() == 0.2
    assert box.take(0.2) == [b"a3"]
    assert box.next_beat() is None


def test_the_focused_drone_is_due_at_once() -> None:
    box = Outbox(0.0)
    box.take(0.0)
    box.focus = ONE
    assert box.offer(ONE, ATTITUDE, b"a")
    box.offer(TWO, ATTITUDE, b"other")
    assert box.take(0.01) == [b"a"]


def test_transactional_frames_keep_their_order_and_come_before_state() -> None:
    box = Outbox(0.0)
    box.offer(ONE, ATTITUDE, b"state")
    box.offer(ONE, None, b"ack 1")
    box.offer(ONE, None, b"ack 2")
    assert box.take(0.0) == [b"ack 1", b"ack 2", b"state"]


def test_a_browser_that_does_not_read_is_told_what_it_lost() -> None:
    box = Outbox(0.0)
    for number in range(MAX_TRANSACTIONAL + 3):
        box.offer(ONE, None, b"%d" % number)
    assert box.take_lost() == {ONE: 3}
    assert box.take_lost() == {}
    taken = box.take(0.0)
    assert len(taken) == MAX_TRANSACTIONAL
    assert taken[0] == b"3"


def test_forgetting_a_drone_leaves_nothing_of_it() -> None:
    box = Outbox(0.0)
    box.focus = ONE
    box.offer(ONE, ATTITUDE, b"focused")
    box.offer(ONE, None, b"ack")
    box.offer(TWO, None, b"theirs")
    box.forget(ONE)
    assert box.take(1.0) == [b"theirs"]
    assert box.focus is None


def test_the_watch_rate_can_be_raised_without_waiting_for_the_old_beat() -> None:
    box = Outbox(0.0)
    box.set_watch_rate(0.2, 0.0)
    box.take(0.0)
    box.offer(ONE, ATTITUDE, b"a")
    assert box.next_beat() == 5.0
    box.set_watch_rate(10.0, 1.0)
    assert box.next_beat() == 1.1


@given(st.lists(st.tuples(st.integers(1, 3), st.one_of(st.none(), st.integers(0, 400)), st.floats(0, 100))))
def test_memory_is_bounded_whatever_is_offered(offers: list[tuple[int, int | None, float]]) -> None:
    box = Outbox(0.0)
    drones = {drone for drone, _, _ in offers}
    for drone, kind, _ in offers:
        box.offer(DroneId(drone), None if kind is None else (1, 1, kind, 0), b"x")
    assert len(box.take(1e6)) <= MAX_TRANSACTIONAL + len(drones) * MAX_STATE_KINDS
    assert box.take(2e6) == []


def test_drones_outside_the_map_come_once_a_second_and_whole() -> None:
    box = Outbox(0.0)
    box.far = {TWO}
    box.take(0.0)
    seen = []
    for step in range(1, 39):
        now = step / 10
        box.offer(ONE, ATTITUDE, b"near")
        box.offer(TWO, ATTITUDE, b"far %d" % step)
        box.offer(TWO, POSITION, b"far position")
        seen += [(now, frame) for frame in box.take(now) if frame.startswith(b"far ")]
    attitudes = [(now, frame) for now, frame in seen if frame != b"far position"]
    times = [now for now, _ in attitudes]
    assert len(times) == 4
    assert all(0.99 < later - sooner < 1.31 for sooner, later in pairwise(times))
    assert all(frame == b"far %d" % round(now * 10) for now, frame in attitudes), "the newest"
    assert [now for now, frame in seen if frame == b"far position"] == times


def test_what_must_not_wait_does_not_wait_outside_the_map_either() -> None:
    box = Outbox(0.0)
    box.far = {ONE, TWO}
    box.focus = ONE
    box.offer(ONE, ATTITUDE, b"focused")
    box.take(0.0)
    box.offer(ONE, ATTITUDE, b"focused")
    box.offer(TWO, ATTITUDE, b"state")
    box.offer(TWO, None, b"ack")
    assert box.take(0.01) == [b"ack", b"focused"]


def test_a_drone_that_comes_into_the_map_is_due_at_the_next_beat() -> None:
    box = Outbox(0.0)
    box.far = {ONE}
    box.take(0.0)
    box.offer(ONE, ATTITUDE, b"a")
    assert box.take(0.2) == [b"a"], "the first one is not late"
    box.offer(ONE, ATTITUDE, b"b")
    assert box.take(0.45) == []
    box.far = set()
    assert box.take(0.7) == [b"b"]


def test_a_drone_that_talks_without_end_loses_its_own_frames_and_nobody_elses() -> None:
    box = Outbox(0.0)
    box.offer(TWO, None, b"quiet")
    for number in range(2 * MAX_TRANSACTIONAL):
        box.offer(ONE, None, b"%d" % number)
        if number % 1000 == 0:
            box.offer(TWO, None, b"quiet")
    assert set(box.take_lost()) == {ONE}
    taken = box.take(0.0)
    assert len(taken) == MAX_TRANSACTIONAL
    assert taken.count(b"quiet") == 10


def test_of_two_drones_with_much_waiting_the_one_with_more_loses() -> None:
    box = Outbox(0.0)
    for number in range(MAX_TRANSACTIONAL - 100):
        box.offer(ONE, None, b"%d" % number)
    for number in range(150):
        box.offer(TWO, None, b"two %d" % number)
    assert box.take_lost() == {ONE: 50}
    assert box.waiting() == (MAX_TRANSACTIONAL, 0)


@pytest.mark.parametrize("focused", [True, False])
def test_kinds_of_state_beyond_the_bound_are_told_as_lost(focused: bool) -> None:
    box = Outbox(now=0.0)
    box.focus = ONE if focused else None
    for kind in range(MAX_STATE_KINDS + 7):
        box.offer(ONE, (1, 1, kind, 0), b"x")
    assert box.take_lost() == {ONE: 7}
    assert len(box.take(10.0)) == MAX_STATE_KINDS
