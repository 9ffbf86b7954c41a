"""Challenges: random, single-use, with a deadline, bound to the requester, and limited in number."""

import itertools

import pytest

from server.accounts.core import challenges
from server.accounts.core.challenges import (
    ASKED_AT_ONCE,
    CHALLENGE_BYTES,
    LIFETIME_S,
    ChallengeOver,
    Challenges,
    Purpose,
    TooManyChallenges,
)
from server.anonymous.core.networks import origin_of

HERE = "browser 1"


def give(store: Challenges, now_s: float = 0.0, *, asker: str = HERE, address: str = "192.0.2.1") -> bytes:
    return store.give(purpose=Purpose.SIGN_IN, asker=asker, address=address, now_s=now_s)


def take(
    store: Challenges, challenge: bytes, now_s: float = 0.0, *, purpose: Purpose = Purpose.SIGN_IN, asker: str = HERE
) -> None:
    store.take(challenge, purpose=purpose, asker=asker, now_s=now_s)


def test_it_is_random_and_good_once() -> None:
    store = Challenges()
    first, second = give(store), give(store)
    assert len(first) == len(second) == CHALLENGE_BYTES
    assert first != second
    take(store, first)
    with pytest.raises(ChallengeOver):
        take(store, first)
    take(store, second)


def test_it_ends() -> None:
    store = Challenges()
    challenge = give(store)
    with pytest.raises(ChallengeOver):
        take(store, challenge, LIFETIME_S)
    assert 120 <= LIFETIME_S <= 300


@pytest.mark.parametrize(
    ("purpose", "asker"), [(Purpose.ADD, HERE), (Purpose.PROVE, HERE), (Purpose.SIGN_IN, "browser 2")]
)
def test_it_is_for_one_purpose_and_one_browser_and_shown_elsewhere_it_is_used_up(purpose: Purpose, asker: str) -> None:
    store = Challenges()
    challenge = give(store)
    with pytest.raises(ChallengeOver):
        take(store, challenge, purpose=purpose, asker=asker)
    with pytest.raises(ChallengeOver):
        take(store, challenge)


def test_one_that_was_never_given_is_refused() -> None:
    with pytest.raises(ChallengeOver):
        take(Challenges(), bytes(CHALLENGE_BYTES))


def test_one_network_asks_so_often_and_another_is_not_kept_waiting() -> None:
    store = Challenges()
    # An IPv6 network counts as one requester, however many addresses it has.
    addresses = itertools.cycle(["2001:db8::1", "2001:db8::ffff:2", "2001:db8:0:0:1::3"])
    for _ in range(ASKED_AT_ONCE):
        give(store, address=next(addresses))
    with pytest.raises(TooManyChallenges) as refused:
        give(store, address=next(addresses))
    assert refused.value.retry_after_s == 1
    give(store, address="2001:db8:0:1::1")
    give(store, 1.0, address=next(addresses))


def test_the_oldest_go_when_there_are_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(challenges, "MAX_CHALLENGES", 5)
    monkeypatch.setattr(challenges, "MAX_NETWORKS", 3)
    store = Challenges()
    given = [give(store, address=f"192.0.2.{number}") for number in range(8)]
    assert len(store) == 5
    for gone in given[:3]:
        with pytest.raises(ChallengeOver):
            take(store, gone)
    for kept in given[3:]:
        take(store, kept)


def test_old_ones_are_forgotten_by_themselves() -> None:
    store = Challenges()
    for number in range(50):
        give(store, asker=f"browser {number}")
    give(store, LIFETIME_S)
    assert len(store) == 1


@pytest.mark.parametrize(
    ("address", "network"),
    [
        ("192.0.2.1", "192.0.2.1"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("::ffff:192.0.2.1", "192.0.2.1"),
        ("", ""),
        ("testclient", "testclient"),
    ],
)
def test_whose_an_address_is(address: str, network: str) -> None:
    assert origin_of(address).address == network
