"""The proof of ownership of a link: valid for one sign-in, one side and one try."""

import hmac
from hashlib import sha256

import pytest

from wire.ids import LinkId
from wire.resuming import NONCE_BYTES, Challenge

KEY, PUBLIC, NONCE = b"k" * 32, b"p" * 32, b"n" * NONCE_BYTES


def challenge(key: bytes = KEY, link_id: int = 7, public_key: bytes = PUBLIC, nonce: bytes = NONCE) -> Challenge:
    return Challenge(key, link_id=LinkId(link_id), public_key=public_key, nonce=nonce)


def test_each_side_proves_what_the_other_expects() -> None:
    agent, tower = challenge(), challenge()
    assert tower.agent_proves(agent.by_agent())
    assert agent.tower_proves(tower.by_tower())


@pytest.mark.parametrize(
    "other",
    [challenge(key=b"K" * 32), challenge(link_id=8), challenge(public_key=b"P" * 32), challenge(nonce=b"N" * 32)],
    ids=["another key", "another link", "another hello", "another challenge"],
)
def test_what_was_proven_elsewhere_proves_nothing_here(other: Challenge) -> None:
    assert not challenge().agent_proves(other.by_agent())
    assert not challenge().tower_proves(other.by_tower())


def test_one_sides_proof_is_not_the_others() -> None:
    assert not challenge().agent_proves(challenge().by_tower())
    assert not challenge().tower_proves(challenge().by_agent())


@pytest.mark.parametrize("proof", [b"", b"x" * 31, b"x" * 32, b"x" * 1000])
def test_there_is_one_try(proof: bytes) -> None:
    tower = challenge()
    assert not tower.agent_proves(proof)
    assert not tower.agent_proves(challenge().by_agent())


def test_a_proof_counts_once() -> None:
    tower = challenge()
    assert tower.agent_proves(challenge().by_agent())
    assert not tower.agent_proves(challenge().by_agent())


def test_the_proofs_are_as_written() -> None:
    said = (7).to_bytes(4, "little") + sha256(PUBLIC).digest() + sha256(NONCE).digest()
    assert challenge().by_agent() == hmac.digest(KEY, b"tower resume v1 agent" + said, "sha256")
    assert challenge().by_tower() == hmac.digest(KEY, b"tower resume v1 tower" + said, "sha256")
