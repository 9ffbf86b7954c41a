"""What a drone and its tower sign: every byte of it, and that no other byte passes."""

import datetime
import struct
from dataclasses import fields, replace
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, ed25519
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import NameOID
from hypothesis import given
from hypothesis import strategies as st

from wire.channel_binding import BadCertificate, end_point
from wire.drone_key import (
    DroneKey,
    MalformedKey,
    enrolment_statement,
    fingerprint,
    is_signed,
    key_bytes,
    key_text,
    parse_drone_key,
)
from wire.ids import DroneId, LinkId
from wire.sign_in import MalformedTranscript, SignInPurpose, Transcript

KEY = DroneKey(DroneId(7), bytes(range(32)))
SAID = Transcript(
    purpose=SignInPurpose.LINK,
    drone_id=7,
    tower="tower.example.org:443",
    drone_key=KEY.public,
    tower_key=b"T" * 32,
    agent_nonce=b"a" * 32,
    tower_nonce=b"t" * 32,
    agent_public_key=b"A" * 32,
    tower_public_key=b"X" * 32,
    binding=b"b" * 32,
    resume=0x01020304,
)
# Computed by hand from docs/wire-protocol.md, not by the code under test.
GOLDEN_SIGNATURE = (
    "6dee586cbd9ef4b1717071db997fb09c28da9e6b9f7751219644dce8d2dc0dfd"
    "4e9974759bae4368a899f78c47431be378bedf639a489daf02c6a05da1dd6d02"
)
GOLDEN_SALT = "8aee6891eab2e7040e515ffc3246f2db20381844fb7cb650ba2f14f700a5b542"
GOLDEN_FOR_TOWER = (
    "636f6e74726f6c2d746f77657220746f776572207369676e732077656c636f6d6500778f903d7c1fd064507af2b7795a"
    "6a1fcbd2beb3a6e2a0a216695c050637733e05000000"
)
GOLDEN_FINGERPRINT = "SHA256:Vkdap1RjR0wChd9dvyvKtz2mUTWIOem3dIGy6rEHcIw"
OTHERWISE: dict[str, Any] = {
    "purpose": SignInPurpose.EXCHANGE,
    "drone_id": 8,
    "tower": "tower.example.org:444",
    "drone_key": b"d" * 32,
    "tower_key": b"U" * 32,
    "agent_nonce": b"c" * 32,
    "tower_nonce": b"u" * 32,
    "agent_public_key": b"B" * 32,
    "tower_public_key": b"Y" * 32,
    "binding": b"",
    "resume": None,
}


def test_the_transcript_is_as_written() -> None:
    assert SAID.encode() == (
        b"control-tower drone sign-in\0"
        + struct.pack("<HBI", 2, 1, 7)
        + KEY.public
        + b"T" * 32
        + b"a" * 32
        + b"t" * 32
        + b"A" * 32
        + b"X" * 32
        + b"\x01\x04\x03\x02\x01"
        + b"\x15\x00tower.example.org:443"
        + b"\x20\x00"
        + b"b" * 32
    )
    assert SAID.for_agent() == b"control-tower agent signs hello\0" + SAID.encode()
    assert KEY.public.hex() == "03a107bff3ce10be1d70dd18e74bc09967e4d6309ba50d5f1ddc8664125531b8"
    # Ed25519 is deterministic: every implementation gives this signature and salt for this transcript.
    assert KEY.sign(SAID.for_agent()).hex() == GOLDEN_SIGNATURE
    assert SAID.salt().hex() == GOLDEN_SALT
    assert SAID.for_tower(LinkId(5)).hex() == GOLDEN_FOR_TOWER


def test_every_field_is_tried() -> None:
    assert {one.name for one in fields(Transcript)} == set(OTHERWISE)


@pytest.mark.parametrize("name", OTHERWISE)
def test_a_signature_holds_for_nothing_but_what_was_signed(name: str) -> None:
    signature = KEY.sign(SAID.for_agent())
    other = replace(SAID, **{name: OTHERWISE[name]})
    assert is_signed(KEY.public, signature, SAID.for_agent())
    assert not is_signed(KEY.public, signature, other.for_agent())
    assert other.salt() != SAID.salt()
    assert other.for_tower(LinkId(5)) != SAID.for_tower(LinkId(5))


def test_what_one_side_signs_is_no_signature_of_the_other_nor_of_an_enrolment() -> None:
    texts = {
        SAID.for_agent(),
        SAID.for_tower(LinkId(5)),
        SAID.for_tower(LinkId(6)),
        enrolment_statement("x", b"k" * 32),
    }
    assert len(texts) == 4
    assert len({text.split(b"\0")[0] for text in texts}) == 3


@given(st.binary(max_size=64), st.binary(max_size=64), st.text(max_size=60), st.text(max_size=60))
def test_two_sign_ins_never_have_the_same_text(one: bytes, other: bytes, name: str, other_name: str) -> None:
    texts = [replace(SAID, binding=b, tower=t).encode() for b, t in ((one, name), (other, other_name))]
    assert (texts[0] == texts[1]) == ((one, name) == (other, other_name))


@pytest.mark.parametrize(
    "wrong",
    [
        {"agent_nonce": b"a" * 31},
        {"tower_key": b""},
        {"drone_key": b"k" * 33},
        {"tower": "ä" * 128},
        {"binding": b"x" * 65},
    ],
)
def test_sizes_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(MalformedTranscript):
        replace(SAID, **wrong)


@pytest.mark.parametrize("signature", [b"", b"s" * 63, b"s" * 64, b"s" * 65])
def test_no_signature_is_none(signature: bytes) -> None:
    assert not is_signed(KEY.public, signature, b"text")
    assert not is_signed(b"short", KEY.sign(b"text"), b"text")


def test_a_key_reads_as_it_is_written_and_shows_itself_to_nobody() -> None:
    assert parse_drone_key(f" {KEY}\n") == KEY
    assert key_text(KEY.seed) not in repr(KEY)
    assert fingerprint(KEY.public) == GOLDEN_FINGERPRINT


@pytest.mark.parametrize("text", ["", "twk_7_short", f"twk_0_{'A' * 43}", f"twd_7_{'A' * 43}", f"twk_7_{'A' * 44}"])
def test_what_is_no_key_is_refused_and_not_repeated(text: str) -> None:
    with pytest.raises(MalformedKey) as caught:
        parse_drone_key(text)
    assert "A" * 43 not in str(caught.value)


@pytest.mark.parametrize("text", ["A" * 42 + "B", "A" * 42, "A" * 42 + "+", "A" * 42 + "ä", "A" * 42 + "\n"])
def test_there_is_one_text_for_each_key(text: str) -> None:
    with pytest.raises(MalformedKey):
        key_bytes(text)


def certificate(key: Any, algorithm: Any) -> bytes:
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "tower")])
    now = datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)
    built = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now)
        .not_valid_after(now + datetime.timedelta(days=1))
        .sign(key, algorithm)
    )
    return built.public_bytes(Encoding.DER)


@pytest.mark.parametrize(
    ("algorithm", "length"),
    [(hashes.SHA256(), 32), (hashes.SHA384(), 48), (hashes.SHA512(), 64), (hashes.SHA3_256(), 32)],
)
def test_the_end_point_is_hashed_as_its_certificate_is(algorithm: Any, length: int) -> None:
    der = certificate(ec.generate_private_key(ec.SECP256R1()), algorithm)
    digest = hashes.Hash(algorithm)
    digest.update(der)
    assert end_point(der) == digest.finalize()
    assert len(end_point(der)) == length


def test_a_certificate_without_a_hash_is_hashed_by_sha256_and_no_certificate_is_an_error() -> None:
    der = certificate(ed25519.Ed25519PrivateKey.generate(), None)
    digest = hashes.Hash(hashes.SHA256())
    digest.update(der)
    assert end_point(der) == digest.finalize()
    with pytest.raises(BadCertificate):
        end_point(b"no certificate")
