"""The table of shares: limits within bounds, what admins choose, and who has used what."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

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
)
from server.kernel.shares_table import shares_table
from server.link.core.flood_gate import FloodGate, FloodLimits
from wire.ids import UserId

LIMITED = [one for one in SHARES.values() if one.default is not None]


def test_the_documentation_has_the_same_table() -> None:
    page = (Path(__file__).parents[3] / "docs" / "shares.md").read_text()
    assert shares_table() in page, "run: python -m server.kernel.shares_table"
    assert max(len(line) for line in shares_table().splitlines()) <= 120


def test_every_name_has_a_row_and_every_default_is_within_its_bounds() -> None:
    assert set(SHARES) == set(ShareName)
    for share in LIMITED:
        check_limit(share, share.default)


@pytest.mark.parametrize("share", LIMITED, ids=lambda share: share.name)
def test_bounds(share: Share) -> None:
    for limit in (share.least, share.most, None):
        check_limit(share, limit)
    for limit in (share.least - 1, share.most + 1):
        with pytest.raises(BadShareLimit, match=f"between {share.least} and {share.most}"):
            check_limit(share, limit)


def test_a_share_with_turns_has_no_limit() -> None:
    with pytest.raises(BadShareLimit):
        check_limit(SHARES[ShareName.WRITES], 5)
    with pytest.raises(KeyError):
        Shares().limit(ShareName.WRITES)


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
        shares.note(ShareName.REQUESTS, 1)
    assert shares.used(ShareName.REQUESTS) == {1: 3}
    shares.tick(WINDOW_S)
    shares.note(ShareName.REQUESTS, 1)
    assert shares.used(ShareName.REQUESTS) == {1: 4}
    shares.tick(WINDOW_S * 2)
    assert shares.used(ShareName.REQUESTS) == {1: 1}
    shares.tick(WINDOW_S * 3)
    assert shares.used(ShareName.REQUESTS) == {}


def test_made_up_names_take_no_memory_without_end() -> None:
    shares = Shares()
    for number in range(1, MAX_NAMED + 500):
        shares.note(ShareName.REQUESTS, number)
    used = shares.used(ShareName.REQUESTS)
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
