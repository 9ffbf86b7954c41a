"""The agent's side of a sign-in: it obeys only the tower that enrolled it."""

from typing import Any

import msgspec
import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey

from onboard_agent.link.signing_in import KeySignIn, NotOurTower
from wire.control_messages import SignInChallenge, Welcome
from wire.drone_key import DroneKey, is_signed, public_half
from wire.ids import DroneId, LinkId
from wire.key_agreement import agree, public_bytes
from wire.sign_in import SignInPurpose, Transcript

KEY = DroneKey(DroneId(7), b"k" * 32)
TOWER = Ed25519PrivateKey.from_private_bytes(b"t" * 32)
OTHER = Ed25519PrivateKey.from_private_bytes(b"o" * 32)
TOWERS_PRIVATE, AGENTS_PRIVATE = (X25519PrivateKey.from_private_bytes(bytes([n]) * 32) for n in (1, 2))
CHALLENGE = SignInChallenge(nonce=b"n" * 32, public_key=public_bytes(TOWERS_PRIVATE), tower_key=public_half(TOWER))


def sign_in(challenge: SignInChallenge = CHALLENGE, **other: Any) -> KeySignIn:
    values: dict[str, Any] = {
        "key": KEY,
        "tower": "tower.example.org:443",
        "tower_key": public_half(TOWER),
        "certificate": None,
        "purpose": SignInPurpose.LINK,
        "private_key": AGENTS_PRIVATE,
        "random_bytes": lambda count: b"r" * count,
        **other,
    }
    return KeySignIn(challenge, **values)


def transcript(**other: Any) -> Transcript:
    """Returns the transcript that the tower builds."""
    values: dict[str, Any] = {
        "purpose": SignInPurpose.LINK,
        "drone_id": 7,
        "tower": "tower.example.org:443",
        "drone_key": KEY.public,
        "tower_key": CHALLENGE.tower_key,
        "agent_nonce": b"r" * 32,
        "tower_nonce": b"n" * 32,
        "agent_public_key": public_bytes(AGENTS_PRIVATE),
        "tower_public_key": CHALLENGE.public_key,
        "binding": b"",
        "resume": None,
        **other,
    }
    return Transcript(**values)


def welcome(by: Ed25519PrivateKey = TOWER, said: Transcript | None = None, **other: Any) -> Welcome:
    signature = by.sign((said or transcript()).for_tower(LinkId(5)))
    values = {
        "drone_id": 7,
        "name": "hawk",
        "link_id": 5,
        "public_key": CHALLENGE.public_key,
        "udp_port": 1,
        "epoch": 1,
    }
    return Welcome(**{**values, "holder": None, "signature": signature, **other})  # type: ignore[arg-type]


def test_both_ends_sign_the_same_and_have_the_same_keys() -> None:
    signing = sign_in()
    hello = signing.hello(takes=("video",), process=3)
    assert (hello.protocol, hello.takes, hello.process) == (2, ("video",), 3)
    assert hello.sign_in is not None
    assert is_signed(KEY.public, hello.sign_in.signature, transcript().for_agent())
    keys = signing.welcomed(welcome())
    assert keys == agree(TOWERS_PRIVATE, hello.public_key, salt=transcript().salt(), link_id=LinkId(5))


@pytest.mark.parametrize(
    "forged",
    [
        welcome(by=OTHER),
        welcome(said=transcript(agent_nonce=b"x" * 32)),
        welcome(said=transcript(drone_id=8)),
        welcome(link_id=6),
        welcome(public_key=public_bytes(AGENTS_PRIVATE)),
        welcome(signature=b""),
    ],
    ids=["by another", "of another sign-in", "to another drone", "another link", "another public key", "by nobody"],
)
def test_a_welcome_that_the_tower_has_not_signed_is_none(forged: Welcome) -> None:
    with pytest.raises(NotOurTower, match="cannot prove that it is the tower"):
        sign_in().welcomed(forged)


def test_another_tower_is_told_nothing() -> None:
    with pytest.raises(NotOurTower, match="is not the tower that enrolled this drone: its key is SHA256:"):
        sign_in(msgspec.structs.replace(CHALLENGE, tower_key=public_half(OTHER)))
    assert sign_in(msgspec.structs.replace(CHALLENGE, tower_key=public_half(OTHER)), tower_key=None).hello()


@pytest.mark.parametrize("change", [{"nonce": b"short"}, {"public_key": b""}])
def test_a_challenge_that_is_none(change: dict[str, bytes]) -> None:
    with pytest.raises(NotOurTower, match="a challenge that is none"):
        sign_in(msgspec.structs.replace(CHALLENGE, **change))


def test_a_tower_that_wants_its_certificate_signed_gets_that_or_nothing() -> None:
    bound = msgspec.structs.replace(CHALLENGE, bound=True)
    with pytest.raises(NotOurTower, match="there is no TLS"):
        sign_in(bound)
    with pytest.raises(NotOurTower, match="a certificate that is none"):
        sign_in(bound, certificate=b"no certificate")
