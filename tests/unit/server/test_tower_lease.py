"""The rules of the lock: a waiting process never takes a lock that its owner may still consider its own."""

from hypothesis import given
from hypothesis import strategies as st

from server.towers.core.tower_lease import (
    HOLD_AFTER_S,
    LEASE_S,
    RENEW_EVERY_S,
    RENEW_WITHIN_S,
    TAKE_AFTER_S,
    WATCHED_FOR_S,
    LockBelief,
    LockState,
    LockWatch,
)

HELD = LockState("a", 1, "host", 42, "http://tower")


def test_a_free_lock_is_taken_at_once() -> None:
    assert LockWatch().may_take(LockState("", 9), 5.0)


def test_an_owner_that_does_not_renew_is_dead_after_the_lease() -> None:
    watch = LockWatch()
    assert not watch.may_take(HELD, 100.0)
    assert not watch.may_take(HELD, 100.0 + TAKE_AFTER_S - 0.01)
    assert watch.may_take(HELD, 100.01 + TAKE_AFTER_S)
    assert not watch.is_alive


def test_each_renewal_begins_the_wait_anew() -> None:
    watch = LockWatch()
    for number in range(20):
        assert not watch.may_take(LockState("a", number), number * 1.0)
    assert watch.is_alive


def test_while_the_database_answers_nobody_no_time_counts() -> None:
    watch = LockWatch()
    watch.may_take(HELD, 0.0)
    watch.unanswered()
    assert not watch.may_take(HELD, 60.0)
    assert watch.may_take(HELD, 60.01 + TAKE_AFTER_S)


def test_an_owner_that_was_stopped_may_not_act_before_it_has_looked() -> None:
    belief = LockBelief(10.0)
    assert belief.may_act(10.0 + LEASE_S - 0.01)
    assert not belief.may_act(10.0 + LEASE_S)
    belief.unanswered(14.0)
    assert not belief.may_act(14.5), "who was stopped must see that nobody has taken it"
    belief.renewed(14.0)
    assert belief.may_act(14.5)
    belief.is_lost = True
    assert not belief.may_act(14.5)


def test_an_owner_whose_database_is_away_goes_on_for_as_long_as_it_tries() -> None:
    belief = LockBelief(0.0)
    at = 0.0
    for _ in range(100):  # each attempt takes the maximum time
        assert belief.may_act(at + RENEW_WITHIN_S)
        belief.unanswered(at)
        at += RENEW_WITHIN_S + RENEW_EVERY_S


def test_an_owner_that_somebody_waits_for_stops_when_its_lease_runs_out() -> None:
    belief = LockBelief(0.0)
    for number in range(4):
        belief.renewed(number * RENEW_EVERY_S, looks=number)
    assert belief.is_watched
    last = 3 * RENEW_EVERY_S
    for late in (0.5, 1.5, 2.5):
        belief.unanswered(last + late)
    assert not belief.must_hold(last + HOLD_AFTER_S - 0.01)
    assert belief.must_hold(last + HOLD_AFTER_S)
    assert belief.may_act(last + LEASE_S - 0.01), "a hold still gets to the drone"
    assert not belief.may_act(last + LEASE_S)
    assert HOLD_AFTER_S + 0.5 < LEASE_S < TAKE_AFTER_S


def test_who_does_not_look_any_more_waits_no_more() -> None:
    belief = LockBelief(0.0)
    belief.renewed(0.0, looks=7)
    assert not belief.is_watched, "they may have looked long ago"
    belief.renewed(0.5, looks=8)
    assert belief.is_watched
    belief.renewed(0.5 + WATCHED_FOR_S, looks=8)
    assert not belief.is_watched
    belief.unanswered(5.0)
    assert belief.may_act(5.0 + LEASE_S - 0.01)


@given(
    renewals=st.lists(st.tuples(st.floats(0, 10), st.floats(0, 5)), min_size=1, max_size=20),
    looks=st.lists(st.floats(0, 3), min_size=1, max_size=60),
    offset=st.floats(-1e6, 1e6),
)
def test_nobody_takes_a_lock_that_its_owner_may_still_believe_in(
    renewals: list[tuple[float, float]], looks: list[float], offset: float
) -> None:
    """Renewals start after pauses and reach the row some time later; the watcher has another clock."""
    commits, at = [(0.0, 0.0)], 0.0
    for pause_s, takes_s in renewals:
        commits.append((at + pause_s, at + pause_s + takes_s))  # (start, arrival in the row)
        at += pause_s + takes_s
    watch, now = LockWatch(), 0.0
    for pause_s in looks:
        now += pause_s
        number, begun_at = [(index, begun) for index, (begun, done) in enumerate(commits) if done <= now][-1]
        if watch.may_take(LockState("a", number), now + offset):
            assert not LockBelief(begun_at).may_act(now)
            break
