"""Key changes on a link: when, how, and what an old key still opens."""

import hashlib
import hmac
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.drops import Dropped, DropReason
from wire.ids import DroneId, LinkId
from wire.rekeying import OVERLAP_S, REKEY_AFTER_DATAGRAMS, REKEY_AFTER_S, Rekeying
from wire.sealed_link import SealedLink
from wire.sealing import Opener, Sealer, next_key

KEY, LINK = b"k" * 32, LinkId(9)


def reason_of(opener: Opener, datagram: bytes) -> DropReason:
    with pytest.raises(Dropped) as caught:
        opener.open(datagram)
    return caught.value.reason


def test_the_next_key_is_hkdf_expand_as_written() -> None:
    assert next_key(KEY) == hmac.digest(KEY, b"tower data v1 next key\x01", hashlib.sha256)


def test_the_receiver_follows_and_opens_what_was_still_on_its_way() -> None:
    sealer, opener = Sealer(KEY, LINK), Opener(KEY, LINK)
    opener.open(sealer.seal(b"1"))
    on_its_way, never_came = sealer.seal(b"2"), sealer.seal(b"3")
    sealer.next_key()
    assert opener.open(sealer.seal(b"4")) == b"4"
    assert opener.phase == 1
    assert opener.open(on_its_way) == b"2"
    assert reason_of(opener, on_its_way) is DropReason.REPLAYED
    opener.retire_last_key()
    assert reason_of(opener, never_came) is DropReason.BAD_KEY_PHASE
    assert opener.open(sealer.seal(b"5")) == b"5"


def test_a_forger_changes_no_key() -> None:
    sealer, opener = Sealer(KEY, LINK), Opener(KEY, LINK)
    good = sealer.seal(b"1")
    for _ in range(3):
        assert reason_of(opener, good[:1] + b"\x01" + good[2:]) is DropReason.NOT_AUTHENTIC
    assert opener.phase == 0
    assert opener.open(good) == b"1"


def test_the_counter_goes_on_so_no_nonce_comes_twice_and_phases_wrap() -> None:
    sealer, opener = Sealer(KEY, LINK), Opener(KEY, LINK)
    seen = []
    for _ in range(600):
        datagram = sealer.seal(b"x")
        opener.open(datagram)
        seen.append((datagram[1], int.from_bytes(datagram[6:14], "little")))
        sealer.next_key()
    assert seen == [(n % 256, n) for n in range(600)]


def test_a_repeat_of_before_the_change_is_refused_after_it() -> None:
    sealer, opener = Sealer(KEY, LINK), Opener(KEY, LINK)
    first = sealer.seal(b"1")
    opener.open(first)
    sealer.next_key()
    opener.open(sealer.seal(b"2"))
    assert reason_of(opener, first) is DropReason.REPLAYED


DUE = [
    ("too early", 0, 1, REKEY_AFTER_S - 1, 100, False),
    ("after the time", 0, 1, REKEY_AFTER_S, 100, True),
    ("after the count", 0, 1, 1.0, REKEY_AFTER_DATAGRAMS, True),
    ("nothing known to have arrived", 0, 0, REKEY_AFTER_S * 9, REKEY_AFTER_DATAGRAMS * 9, False),
]


@pytest.mark.parametrize(("arrived", "now", "sealed", "expected"), [row[2:] for row in DUE], ids=[r[0] for r in DUE])
def test_when_a_key_is_changed(arrived: int, now: float, sealed: int, expected: bool) -> None:
    assert Rekeying(0.0).due(sealed=sealed, arrived=arrived, now=now) is expected


def test_the_next_change_waits_until_the_new_key_is_known_to_work() -> None:
    rekeying = Rekeying(0.0)
    assert rekeying.due(sealed=100, arrived=90, now=REKEY_AFTER_S)
    later = 5 * REKEY_AFTER_S
    assert not rekeying.due(sealed=500, arrived=100, now=later)
    assert rekeying.due(sealed=500, arrived=101, now=later)


def links() -> tuple[SealedLink, SealedLink]:
    return tuple(
        SealedLink(link_id=LINK, drone_id=DroneId(1), send_key=send, receive_key=receive, now=0.0)
        for send, receive in ((b"a" * 32, b"b" * 32), (b"b" * 32, b"a" * 32))
    )  # type: ignore[return-value]


def test_both_ends_of_a_link_change_keys_by_themselves_and_nothing_is_lost() -> None:
    agent, tower = links()
    now, phases = 0.0, set()
    while now < 3.5 * REKEY_AFTER_S:
        now += 5.0
        for sender, receiver in ((agent, tower), (tower, agent)):
            for datagram in sender.datagrams_to_send(now):
                phases.add(datagram[1])
                receiver.receive(datagram, now)
    assert phases == {0, 1, 2, 3}


def test_the_last_key_is_given_up_a_while_after_the_change() -> None:
    agent, tower = links()
    for now in (1.0, 2.0):
        for sender, receiver in ((agent, tower), (tower, agent)):
            for datagram in sender.datagrams_to_send(now):
                receiver.receive(datagram, now)
    early, late = agent.seal_urgent(b"early"), agent.seal_urgent(b"late")
    now = REKEY_AFTER_S + 1
    *_, ping = agent.datagrams_to_send(now)
    assert ping[1] == 1
    tower.receive(ping, now)
    tower.datagrams_to_send(now)
    assert tower.receive(early, now + OVERLAP_S - 1).urgent == b"early"
    tower.datagrams_to_send(now + OVERLAP_S + 1)
    with pytest.raises(Dropped) as caught:
        tower.receive(late, now + OVERLAP_S + 1)
    assert caught.value.reason is DropReason.BAD_KEY_PHASE


@given(st.integers(0, 1 << 30), st.floats(0, 0.6))
def test_a_link_that_loses_much_never_falls_out_of_step(seed: int, loss: float) -> None:
    """Changes keys at every opportunity, with lost and reordered datagrams: every datagram that arrives opens."""
    chance = random.Random(seed)
    agent, tower = links()
    now = 0.0
    on_the_way: list[tuple[float, SealedLink, bytes]] = []
    for _ in range(60):
        now += REKEY_AFTER_S + 1
        for sender, receiver in ((agent, tower), (tower, agent)):
            datagrams = sender.datagrams_to_send(now)
            on_the_way += [(now + chance.random(), receiver, one) for one in datagrams if chance.random() >= loss]
        for _, receiver, datagram in sorted(on_the_way, key=lambda one: one[0]):
            receiver.receive(datagram, now + 1.0)
        on_the_way.clear()
