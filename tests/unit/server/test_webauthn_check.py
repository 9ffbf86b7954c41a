"""Checks of an authenticator's response: a valid one passes, and every kind of fault is refused."""

import json
import secrets
from typing import Any

import cbor2
import pytest
from worlds.soft_authenticator import SoftAuthenticator, b64, unb64

from server.accounts.core.relying_party import RelyingParty
from server.accounts.core.webauthn_check import check_assertion, check_new, creation_options, request_options
from server.accounts.core.webauthn_values import KnownCredential, NewCredential, PasskeyFault, challenge_in

PARTY = RelyingParty("tower.example.org", "https://tower.example.org")
HANDLE = bytes(range(32))


def creation(challenge: bytes, there: tuple[KnownCredential, ...] = ()) -> dict[str, Any]:
    return creation_options(PARTY, challenge=challenge, user_handle=HANDLE, name="Anna", there=there)


def made(authenticator: SoftAuthenticator, **faults: Any) -> NewCredential:
    challenge = secrets.token_bytes(32)
    answer = authenticator.make(creation(challenge), **faults)
    return check_new(answer, challenge=challenge, party=PARTY)


@pytest.fixture(params=["P-256", "Ed25519"])
def authenticator(request: pytest.FixtureRequest) -> SoftAuthenticator:
    return SoftAuthenticator(PARTY.origin, edwards=request.param == "Ed25519")


def test_what_is_asked_for() -> None:
    challenge = secrets.token_bytes(32)
    there = KnownCredential(b"credential", ("internal", "usb"))
    options = creation(challenge, (there,))
    json.dumps(options)
    assert unb64(options["challenge"]) == challenge
    assert options["rp"] == {"id": "tower.example.org", "name": "Control Tower"}
    assert unb64(options["user"]["id"]) == HANDLE
    assert options["user"]["name"] == "Anna"
    assert options["attestation"] == "none"
    chosen = options["authenticatorSelection"]
    assert (chosen["residentKey"], chosen["requireResidentKey"]) == ("required", True)
    assert chosen["userVerification"] == "required"
    assert options["excludeCredentials"] == [
        {"id": b64(b"credential"), "type": "public-key", "transports": ["internal", "usb"]}
    ]
    asked = request_options(PARTY, challenge=challenge)
    assert asked["userVerification"] == "required"
    assert asked["rpId"] == PARTY.id
    assert asked["allowCredentials"] == []
    assert asked["timeout"] == 300_000


def test_a_passkey_is_made_and_signs(authenticator: SoftAuthenticator) -> None:
    new = made(authenticator)
    assert (new.id, new.sign_count, new.synced) == (authenticator.credentials[0].id, 0, False)
    assert new.transports == ("hybrid", "internal")
    challenge = secrets.token_bytes(32)
    answer = authenticator.get(request_options(PARTY, challenge=challenge))
    assert challenge_in(answer["response"]["clientDataJSON"]) == challenge
    found = check_assertion(answer, challenge=challenge, party=PARTY, public_key=new.public_key)
    assert (found.sign_count, found.synced) == (1, False)


def test_an_authenticator_that_attests_with_the_new_key_itself_is_taken() -> None:
    assert made(SoftAuthenticator(PARTY.origin), attests_itself=True).sign_count == 0


def test_a_synced_passkey_is_known_as_one() -> None:
    assert made(SoftAuthenticator(PARTY.origin, counts=False, is_synced=True)).synced


@pytest.mark.parametrize(
    ("faults", "why"),
    [
        ({"origin": "https://tower.example.org.evil.example"}, "wrong origin"),
        ({"origin": "http://tower.example.org"}, "wrong origin"),
        ({"party_id": "evil.example"}, "made for another site"),
        ({"is_verified": False}, "the person was not verified"),
        ({"kind": "webauthn.get"}, "malformed"),
        ({"attestation": {"fmt": "android-safetynet", "attStmt": {"ver": "1", "response": b"x"}}}, "nobody asked for"),
        ({"attestation": {"fmt": "packed", "attStmt": {"alg": -7, "sig": b"x", "x5c": [b"x"]}}}, "nobody asked for"),
        ({"attestation": {"fmt": "packed", "attStmt": {"alg": -7, "sig": b"x"}}}, "signature|malformed"),
        ({"attestation": {"fmt": "of-our-own", "attStmt": {}}}, "nobody asked for"),
    ],
)
def test_a_new_passkey_is_refused(faults: dict[str, Any], why: str) -> None:
    with pytest.raises(PasskeyFault, match=why):
        made(SoftAuthenticator(PARTY.origin), **faults)


def test_a_new_passkey_for_another_challenge_or_with_another_id_is_refused() -> None:
    authenticator = SoftAuthenticator(PARTY.origin)
    challenge = secrets.token_bytes(32)
    with pytest.raises(PasskeyFault, match="wrong challenge"):
        check_new(authenticator.make(creation(challenge)), challenge=bytes(32), party=PARTY)
    answer = authenticator.make(creation(challenge))
    other = b64(secrets.token_bytes(16))
    with pytest.raises(PasskeyFault, match="the credential's id is not its own"):
        check_new(answer | {"id": other, "rawId": other}, challenge=challenge, party=PARTY)


@pytest.mark.parametrize(
    ("faults", "why"),
    [
        ({"origin": "https://evil.example"}, "wrong origin"),
        ({"origin": "https://tower.example.org:8443"}, "wrong origin"),
        ({"party_id": "evil.example"}, "made for another site"),
        ({"challenge": b64(bytes(32))}, "wrong challenge"),
        ({"is_verified": False}, "the person was not verified"),
        ({"tamper": True}, "wrong signature"),
        ({"kind": "webauthn.create"}, "malformed"),
    ],
)
def test_a_signature_is_refused(authenticator: SoftAuthenticator, faults: dict[str, Any], why: str) -> None:
    new = made(authenticator)
    challenge = secrets.token_bytes(32)
    answer = authenticator.get(request_options(PARTY, challenge=challenge), **faults)
    with pytest.raises(PasskeyFault, match=why):
        check_assertion(answer, challenge=challenge, party=PARTY, public_key=new.public_key)


def test_a_signature_by_another_key_is_refused() -> None:
    authenticator, other = SoftAuthenticator(PARTY.origin), SoftAuthenticator(PARTY.origin)
    new, _ = made(authenticator), made(other)
    challenge = secrets.token_bytes(32)
    answer = other.get(request_options(PARTY, challenge=challenge))
    with pytest.raises(PasskeyFault, match="wrong signature"):
        check_assertion(answer, challenge=challenge, party=PARTY, public_key=new.public_key)


DEEP = b"\x81" * 12_000 + b"\x01"


@pytest.mark.parametrize(
    "attestation",
    [b"", b"\x00", DEEP, cbor2.dumps({}), cbor2.dumps([1, 2]), cbor2.dumps({"fmt": "none", "attStmt": {}})],
    ids=["empty", "a number", "deep", "an empty map", "a list", "no data"],
)
def test_odd_cbor_is_refused_and_nothing_else_happens(attestation: bytes) -> None:
    challenge = secrets.token_bytes(32)
    answer = SoftAuthenticator(PARTY.origin).make(creation(challenge))
    answer["response"]["attestationObject"] = b64(attestation)
    with pytest.raises(PasskeyFault):
        check_new(answer, challenge=challenge, party=PARTY)


@pytest.mark.parametrize(
    "document",
    [
        b"",
        b"nonsense",
        b"[]",
        b"{}",
        b'{"challenge": 5}',
        b'{"challenge": null}',
        b"[" * 3000,
        "\N{BOX DRAWINGS LIGHT HORIZONTAL}".encode("utf-16"),
    ],
    ids=["empty", "no json", "a list", "no challenge", "a number", "null", "deep", "utf-16"],
)
def test_odd_client_data_is_refused(document: bytes) -> None:
    with pytest.raises(PasskeyFault):
        challenge_in(b64(document))


def test_an_answer_that_another_site_had_in_a_frame_is_refused() -> None:
    authenticator = SoftAuthenticator(PARTY.origin)
    made(authenticator)
    answer = authenticator.get(
        request_options(PARTY, challenge=bytes(32)),
        client_extra={"crossOrigin": True, "topOrigin": "https://evil.example"},
    )
    with pytest.raises(PasskeyFault, match="inside another site"):
        challenge_in(answer["response"]["clientDataJSON"])
