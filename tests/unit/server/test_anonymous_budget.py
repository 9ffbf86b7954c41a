"""Limits for strangers before they sign in: the cores, with simulated time, and the table repeated in the docs."""

import re
from dataclasses import fields, replace
from pathlib import Path

import pytest

from server.anonymous.core.budget import AnonymousBudget, Over, origin_of_anonymous
from server.anonymous.core.connections import AnonymousConnection, ConnectionBudget
from server.anonymous.core.fair_queue import Bounds, FairQueue, Priority, Ticket
from server.anonymous.core.hashing import Caller, HashingSlots
from server.anonymous.core.known_addresses import KnownAddresses
from server.anonymous.core.limits import LIMITS
from server.anonymous.core.log_lines import LogBudget
from server.anonymous.core.networks import origin_of
from server.anonymous.core.slices import Slices

DOCS = Path(__file__).resolve().parents[3] / "docs"
KEY = b"k" * 32


def known(*addresses: str) -> KnownAddresses:
    made = KnownAddresses(KEY, 100)
    for one in addresses:
        made.remember(origin_of(one))
    return made


# -- networks ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "address", "network"),
    [
        ("203.0.113.7", "203.0.113.7", "203.0.113.0/24"),
        ("::ffff:203.0.113.7", "203.0.113.7", "203.0.113.0/24"),
        ("2001:db8:1:2::5", "2001:db8:1:2::/64", "2001:db8:1::/48"),
        ("2001:db8:1:2:ffff::9", "2001:db8:1:2::/64", "2001:db8:1::/48"),
        ("fe80::1%eth0", "fe80::/64", "fe80::/48"),
        ("::1", "::/64", "::/48"),
        ("no address", "no address", "no address"),
        ("", "", ""),
    ],
)
def test_what_counts_as_one_peer(text: str, address: str, network: str) -> None:
    assert (origin_of(text).address, origin_of(text).network) == (address, network)


def test_a_whole_64_is_one_address_and_other_64s_are_others() -> None:
    assert len({origin_of(f"2001:db8:1:2::{one:x}") for one in range(1000)}) == 1
    assert len({origin_of(f"2001:db8:1:{one:x}::1").address for one in range(1000)}) == 1000
    assert len({origin_of(f"2001:db8:1:{one:x}::1").network for one in range(1000)}) == 1


# -- known addresses -----------------------------------------------------------------------------------------------


def test_known_addresses_are_known_by_name_and_forgotten_oldest_first() -> None:
    some = KnownAddresses(KEY, 4)
    some.remember(origin_of("203.0.113.1"), "anna")
    assert some.knows(origin_of("203.0.113.1"), "anna")
    assert some.knows(origin_of("203.0.113.1"))
    assert not some.knows(origin_of("203.0.113.1"), "ben")
    assert not some.knows(origin_of("203.0.113.2"), "anna")
    some.remember(origin_of("203.0.113.2"), "ben")
    some.remember(origin_of("203.0.113.3"), "cleo")
    assert len(some) == 4
    assert not some.knows(origin_of("203.0.113.1"))
    assert some.knows(origin_of("203.0.113.3"), "cleo")


def test_what_is_remembered_of_an_address_does_not_contain_it() -> None:
    some = known("203.0.113.1")
    assert b"203" not in b"".join(some._known)
    assert set(some._known) != set(KnownAddresses(b"x" * 32, 9)._known | known("203.0.113.2")._known)


# -- turns ---------------------------------------------------------------------------------------------------------


def line(per_address: int = 100, per_network: int = 100, total: int = 1000) -> FairQueue[str]:
    return FairQueue(Bounds(per_address, per_network, total))


def join(where: FairQueue[str], item: str, address: str, standing: Priority = Priority.FRESH) -> Ticket[str] | None:
    return where.join(item, origin_of(address), standing)[0]


def called(where: FairQueue[str]) -> list[str]:
    found = []
    while (ticket := where.call()) is not None:
        found.append(ticket.item)
    return found


def test_networks_take_turns_however_many_addresses_and_requests_they_have() -> None:
    some = line()
    for number in range(90):
        join(some, "flood", f"2001:db8:1:{number:x}::1")
    join(some, "one", "198.51.100.1")
    join(some, "two", "198.51.100.2")
    order = called(some)
    assert order.index("one") <= 1
    assert order.index("two") <= 3
    assert len(order) == 92


def test_a_newcomer_is_not_sent_to_the_end_of_a_flood_that_has_been_going_on() -> None:
    some = line()
    for _ in range(50):
        join(some, "flood", "203.0.113.1")
    for _ in range(30):
        assert some.call() is not None
    join(some, "new", "198.51.100.1")
    order = called(some)
    assert order.index("new") <= 1


def test_better_standing_goes_first() -> None:
    some = line()
    join(some, "suspect", "203.0.113.1", Priority.SUSPECT)
    join(some, "fresh", "203.0.113.2", Priority.FRESH)
    join(some, "known", "203.0.113.3", Priority.KNOWN)
    assert some.call(Priority.KNOWN) is not None
    assert some.call(Priority.KNOWN) is None
    assert called(some) == ["fresh", "suspect"]


def test_a_line_is_bounded_by_address_network_and_in_all() -> None:
    some = line(per_address=2, per_network=3, total=5)
    assert [join(some, "x", "203.0.113.1") is not None for _ in range(3)] == [True, True, False]
    assert [join(some, "x", "203.0.113.2") is not None for _ in range(2)] == [True, False]
    assert join(some, "x", "198.51.100.1") is not None
    assert join(some, "x", "198.51.101.1") is not None
    assert join(some, "x", "198.51.102.1") is None
    assert len(some) == 5


def test_a_known_address_has_more_places_where_the_line_says_so() -> None:
    some = FairQueue[str](Bounds(per_address=2, per_network=100, total=100, known_factor=3))
    assert sum(join(some, "x", "203.0.113.1") is not None for _ in range(9)) == 2
    assert sum(join(some, "x", "198.51.100.1", Priority.KNOWN) is not None for _ in range(9)) == 6


def test_a_full_line_makes_room_for_a_better_one_and_for_no_equal() -> None:
    some = line(total=2)
    first = join(some, "suspect 1", "203.0.113.1", Priority.SUSPECT)
    last = join(some, "suspect 2", "203.0.114.1", Priority.SUSPECT)
    ticket, pushed_out = some.join("fresh", origin_of("198.51.100.1"), Priority.FRESH)
    assert ticket is not None
    assert pushed_out is last
    assert pushed_out is not None and not pushed_out.waiting
    assert first is not None and first.waiting
    assert some.join("fresh 2", origin_of("198.51.101.1"), Priority.FRESH)[1] is first
    assert some.join("fresh 3", origin_of("198.51.102.1"), Priority.FRESH) == (None, None)
    assert called(some) == ["fresh", "fresh 2"]


def test_who_leaves_is_not_called_and_nothing_is_kept_of_them() -> None:
    some = line(per_address=1)
    for round_ in range(200):
        ticket = join(some, "gone", "203.0.113.1")
        assert ticket is not None, round_
        some.leave(ticket)
        some.leave(ticket)
    assert len(some) == 0
    assert called(some) == []
    assert len(some._heap) < 40
    assert not some._of
    assert not some._last


# -- connections ---------------------------------------------------------------------------------------------------


class Connections:
    def __init__(self, *known_ones: str, **limits: int) -> None:
        self.budget = ConnectionBudget(replace(LIMITS, **limits), known(*known_ones))
        self.cut: list[str] = []

    def come(self, address: str, *, is_proxy: bool = False) -> AnonymousConnection | None:
        return self.budget.come(origin_of(address), is_proxy=is_proxy, cut=lambda: self.cut.append(address))


def test_connections_are_bounded_by_address_and_by_network() -> None:
    some = Connections(max_connections_per_address=2, max_connections_per_network=3)
    assert [some.come("203.0.113.1") is not None for _ in range(3)] == [True, True, False]
    assert [some.come("203.0.113.2") is not None for _ in range(2)] == [True, False]
    assert some.come("203.0.114.1") is not None


def test_one_that_has_signed_in_or_ended_makes_room() -> None:
    some = Connections(max_connections_per_address=1)
    anonymous = some.come("203.0.113.1")
    assert anonymous is not None
    some.budget.admit(anonymous)
    some.budget.gone(anonymous)
    second = some.come("203.0.113.1")
    assert second is not None and anonymous.is_admitted and not second.is_admitted
    some.budget.gone(second)
    some.budget.gone(second)
    assert some.come("203.0.113.1") is not None
    assert len(some.budget) == 1


def test_a_full_tower_ends_the_oldest_of_the_network_that_has_most() -> None:
    some = Connections(max_connections=10)
    for number in range(10):
        assert some.come(f"203.0.113.{number}") is not None
    assert some.come("198.51.100.1") is not None
    assert some.cut == ["203.0.113.0"]
    assert some.come("203.0.113.99") is None
    assert len(some.budget) == 10


def test_known_addresses_may_have_more_and_come_in_when_strangers_fill_the_tower() -> None:
    some = Connections("192.0.2.1", max_connections=3, max_connections_per_address=2, known_address_factor=4)
    for number in range(3):
        assert some.come(f"203.0.11{number}.1") is not None
    assert [some.come("192.0.2.1") is not None for _ in range(9)] == [True] * 8 + [False]
    assert some.cut == []


def test_a_trusted_proxy_is_not_counted_as_one_address() -> None:
    some = Connections(max_connections_per_address=1, max_connections=1)
    assert all(some.come("192.0.2.9", is_proxy=True) is not None for _ in range(100))
    budget = AnonymousBudget(now=0.0, trusted_proxies="127.0.0.1,10.1.0.0/16")
    assert budget.is_proxy("127.0.0.1")
    assert budget.is_proxy("10.1.2.3")
    assert not budget.is_proxy("127.0.0.2")
    assert not budget.is_proxy("unix")
    assert origin_of_anonymous("10.1.2.3", 5, is_proxy=True) != origin_of_anonymous("10.1.2.3", 6, is_proxy=True)


def test_handshakes_are_bounded_and_end_once() -> None:
    limits = replace(LIMITS, max_handshakes=3, max_handshakes_per_address=2, known_address_factor=2)
    budget = AnonymousBudget(now=0.0, limits=limits)
    here, there = origin_of("203.0.113.1"), origin_of("198.51.100.1")
    assert [budget.begin_handshake(here, is_known=False) for _ in range(3)] == [True, True, False]
    assert [budget.begin_handshake(there, is_known=False) for _ in range(2)] == [True, False]
    assert budget.begin_handshake(there, is_known=True)
    assert budget.refused[Over.HANDSHAKES] == 2
    budget.end_handshake(here)
    budget.end_handshake(here)
    assert budget.handshakes.total() == 2


# -- hashing -------------------------------------------------------------------------------------------------------


def slots(count: int = 2) -> HashingSlots[str]:
    return HashingSlots(count, LIMITS)


def ask(where: HashingSlots[str], item: str, address: str, standing: Priority) -> bool:
    return where.ask(item, Caller(origin_of(address), standing)).ticket is not None


def test_a_slot_is_kept_for_known_addresses() -> None:
    some = slots()
    for number in range(8):
        assert ask(some, "stranger", f"203.0.{number}.1", Priority.FRESH)
    stranger = some.next()
    assert stranger is not None
    assert some.next() is None
    assert ask(some, "known", "192.0.2.1", Priority.KNOWN)
    second = some.next()
    assert second is not None and second.item == "known"
    some.done(stranger)
    third = some.next()
    assert third is not None and third.item == "stranger"


def test_with_one_thread_the_known_go_first() -> None:
    some = slots(1)
    assert ask(some, "stranger 1", "203.0.1.1", Priority.FRESH)
    assert ask(some, "stranger 2", "203.0.2.1", Priority.FRESH)
    first = some.next()
    assert first is not None
    assert ask(some, "known", "192.0.2.1", Priority.KNOWN)
    some.done(first)
    second = some.next()
    assert second is not None and second.item == "known"


def test_a_newcomer_need_not_wait_for_the_first_tries_of_many_networks() -> None:
    some = slots()
    for number in range(40):
        assert ask(some, "flood", f"203.0.{number}.1", Priority.FRESH)
    assert ask(some, "owner", "198.51.100.1", Priority.FRESH)
    first = some.next()
    assert first is not None and first.item == "owner"


def test_180_sign_ins_of_one_64_leave_the_line_to_the_others() -> None:
    """The attack of issue 16: it filled a queue of 64 for everybody."""
    some = slots()
    taken = [ask(some, "flood", f"2001:db8:1:2::{number:x}", Priority.SUSPECT) for number in range(180)]
    assert sum(taken) == LIMITS.max_waiting_hashes_per_address
    assert ask(some, "owner", "198.51.100.1", Priority.FRESH)
    first = some.next()
    assert first is not None and first.item == "owner"


def test_many_64s_of_one_48_count_together() -> None:
    some = slots()
    taken = [ask(some, "flood", f"2001:db8:1:{number:x}::1", Priority.SUSPECT) for number in range(180)]
    assert sum(taken) == LIMITS.max_waiting_hashes_per_network


# -- slices and log lines ------------------------------------------------------------------------------------------


def test_a_slice_is_followed_by_a_rest() -> None:
    some = Slices(slice_s=0.002, rest_s=0.008)
    assert some.wait_s(10.0) == 0.0
    some.used(0.001)
    assert some.wait_s(10.001) == 0.0
    some.used(0.0015)
    assert some.wait_s(10.002) == pytest.approx(0.008)
    assert some.wait_s(10.0101) == 0.0
    some.used(5.0)
    assert some.wait_s(10.011) > 0


def test_log_lines_are_bounded_and_what_was_left_out_is_told_once() -> None:
    some = LogBudget(per_s=1.0, burst=3.0, now=0.0)
    assert [some.admits(0.0) for _ in range(10)] == [True] * 3 + [False] * 7
    assert some.admits(1.0)
    assert some.take_unreported() == 7
    assert some.take_unreported() == 0


# -- the table -----------------------------------------------------------------------------------------------------


def test_the_documents_repeat_the_table() -> None:
    text = (DOCS / "anonymous-budget.md").read_text()
    rows = dict(re.findall(r"^\| `(\w+)` \| ([\d.,]+)", text, re.MULTILINE))
    assert {name: float(value.replace(",", "")) for name, value in rows.items()} == {
        one.name: float(getattr(LIMITS, one.name)) for one in fields(LIMITS)
    }


def test_the_documents_name_everything_that_is_counted() -> None:
    text = (DOCS / "anonymous-budget.md").read_text()
    assert {one.value for one in Over} == set(re.findall(r"`what=\"([a-z-]+)\"`", text))
