"""The table of shares: limits within bounds, what admins choose, and who has used what."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.http.request_shares import RequestShares, TooManyRequests
from server.kernel.access import Action
from server.kernel.fair_queue import FairQueue
from server.kernel.shares import (
    MAX_NAMED,
    NOBODY,
    SHARES,
    WINDOW_S,
    BadShareLimit,
    Share,
    ShareName,
    Shares,
    check_limit,
    read_limits,
)
from server.kernel.shares_table import shares_table
from server.link.core.flood_gate import FloodGate, FloodLimits
from wire.ids import UserId


def test_the_documentation_has_the_same_table() -> None:
    page = (Path(__file__).parents[3] / "docs" / "shares.md").read_text()
    assert shares_table() in page, "run: python -m server.kernel.shares_table"
    assert max(len(line) for line in shares_table().splitlines()) <= 120


def test_every_name_has_a_row_and_every_default_is_within_its_bounds() -> None:
    assert set(SHARES) == set(ShareName)
    for share in SHARES.values():
        check_limit(share, share.default)


@pytest.mark.parametrize("share", SHARES.values(), ids=lambda share: share.name)
def test_bounds(share: Share) -> None:
    for limit in (share.least, share.most, None):
        check_limit(share, limit)
    for limit in (share.least - 1, share.most + 1):
        with pytest.raises(BadShareLimit, match=f"between {share.least} and {share.most}"):
            check_limit(share, limit)


@pytest.mark.parametrize(
    "text",
    ["zoens=80", "zones", "zones=", "zones=1e3", "zones=-1", "zones=0", "zones=251", "zones=80,zones=90", "=5", ","],
)
def test_a_default_of_a_tower_that_is_none(text: str) -> None:
    with pytest.raises(ValueError, match=r"^must "):
        read_limits(text)


def test_a_tower_may_have_other_defaults() -> None:
    shares = Shares(read_limits(" zones=80, operations = 200"))
    assert (shares.limit(ShareName.ZONES), shares.limit(ShareName.OPERATIONS)) == (80, 200)
    assert shares.limit(ShareName.IMPORTS) == SHARES[ShareName.IMPORTS].default
    shares.apply({"zones": 7})
    assert (shares.limit(ShareName.ZONES), shares.default(ShareName.ZONES)) == (7, 80)


def test_what_an_admin_chose_counts_until_it_is_taken_back() -> None:
    shares = Shares()
    assert shares.limit(ShareName.ZONES) == 50
    assert shares.apply({"zones": 7})
    assert not shares.apply({"zones": 7})
    assert shares.limit(ShareName.ZONES) == 7
    assert shares.apply({})
    assert shares.limit(ShareName.ZONES) == 50


def test_use_is_counted_for_a_minute_and_forgotten() -> None:
    shares = Shares()
    shares.tick(0.0)
    for _ in range(3):
        shares.note(ShareName.REQUEST_TIME, 1)
    assert shares.used(ShareName.REQUEST_TIME) == {1: 3}
    shares.tick(WINDOW_S)
    shares.note(ShareName.REQUEST_TIME, 1)
    assert shares.used(ShareName.REQUEST_TIME) == {1: 4}
    shares.tick(WINDOW_S * 2)
    assert shares.used(ShareName.REQUEST_TIME) == {1: 1}
    shares.tick(WINDOW_S * 3)
    assert shares.used(ShareName.REQUEST_TIME) == {}


def test_made_up_names_take_no_memory_without_end() -> None:
    shares = Shares()
    for number in range(1, MAX_NAMED + 500):
        shares.note(ShareName.REQUEST_TIME, number)
    used = shares.used(ShareName.REQUEST_TIME)
    assert len(used) == MAX_NAMED + 1
    assert used[NOBODY] == 499


def test_a_change_counts_for_accounts_that_are_open() -> None:
    shares = Shares()
    gate = FloodGate(FloodLimits(), shares)
    someone = UserId(1)
    assert all(gate.admits_operation(someone, 0.0, stops=False) for _ in range(100))
    assert not gate.admits_operation(someone, 0.0, stops=False)
    shares.apply({ShareName.OPERATIONS: 10})
    admitted = sum(gate.admits_operation(someone, 0.0, stops=False) for _ in range(50))
    assert admitted == 10
    assert sum(gate.admits_operation(someone, 0.0, stops=True) for _ in range(50)) == 10, "stopping has its own"


@given(st.lists(st.tuples(st.integers(1, 4), st.integers(1, 20)), max_size=200))
def test_a_queue_whose_share_shrinks_drops_the_oldest_of_the_same_one(puts: list[tuple[int, int]]) -> None:
    queue: FairQueue[int, int] = FairQueue(5)
    for number, (whose, share) in enumerate(puts):
        queue.share = share
        others = {one: count for one, count in queue.all_waiting().items() if one != whose}
        queue.put(whose, number)
        waiting = queue.all_waiting()
        assert waiting[whose] <= share
        assert {one: count for one, count in waiting.items() if one != whose} == others
        assert len(queue) == sum(waiting.values())


def test_requests_of_one_person_have_a_limit_and_those_that_fly_have_none() -> None:
    now = [0.0]
    shares = Shares({ShareName.REQUEST_TIME: 20, ShareName.WRITES: 5})
    requests = RequestShares(shares, lambda: now[0])
    alice, bob = UserId(1), UserId(2)
    for _ in range(5):
        requests.admit(alice, Action.CHANGE_PREFERENCES, "PUT")
    with pytest.raises(TooManyRequests) as refused:
        requests.admit(alice, Action.CHANGE_PREFERENCES, "PUT")
    assert refused.value.retry_after_s == pytest.approx(2.0)
    for _ in range(14):  # the refused one had its place, and not its change
        requests.admit(alice, Action.SEE_DRONE, "GET")
    with pytest.raises(TooManyRequests):
        requests.admit(alice, Action.SEE_DRONE, "GET")
    for method in ("POST", "GET"):
        requests.admit(alice, Action.FLY, method)
        requests.admit(alice, Action.COMMAND, method)
        requests.admit(bob, Action.SEE_DRONE, method)
    now[0] += 10.0
    requests.admit(alice, Action.CHANGE_PREFERENCES, "PUT")


def test_a_limit_of_requests_that_an_admin_changes_counts_at_once() -> None:
    shares = Shares({ShareName.REQUEST_TIME: 1})
    requests = RequestShares(shares, lambda: 0.0)
    requests.admit(UserId(1), Action.SEE_DRONE, "GET")
    with pytest.raises(TooManyRequests):
        requests.admit(UserId(1), Action.SEE_DRONE, "GET")
    shares.apply({"request-time": 500})
    requests.admit(UserId(1), Action.SEE_DRONE, "GET")


def test_what_a_request_took_is_owed_and_no_more_than_one_burst() -> None:
    now = [0.0]
    shares = Shares({ShareName.REQUEST_TIME: 3_000})
    requests = RequestShares(shares, lambda: now[0])
    alice = UserId(1)
    assert requests.admit(alice, Action.SEE_DRONE, "GET")
    requests.spent(alice, 5.0)
    assert shares.used(ShareName.REQUEST_TIME) == {1: 5_001}
    with pytest.raises(TooManyRequests) as refused:
        requests.admit(alice, Action.SEE_DRONE, "GET")
    assert refused.value.retry_after_s == pytest.approx(20.0, abs=0.1), "2 s too much, and a tenth of a processor"
    assert not requests.admit(alice, Action.FLY, "POST"), "what flies costs nothing, and is never refused"
    requests.admit(UserId(2), Action.SEE_DRONE, "GET")
    now[0] = 20.1
    requests.admit(alice, Action.SEE_DRONE, "GET")
    requests.spent(alice, 1_000.0)
    now[0] += 30.1
    requests.admit(alice, Action.SEE_DRONE, "GET")
