"""Signatures, against pymavlink as another implementation of the same guide."""

from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import ardupilotmega as first_version
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from wire.frame_signing import fits, is_signed, sign, stamp_of, ticks_of, without_signature
from wire.frames import MAGIC_V1, MAGIC_V2, checksum_holds, payload, source

KEY = bytes(range(32))
OTHER = bytes(32)
keys = st.binary(min_size=32, max_size=32)
ticks = st.integers(1, (1 << 48) - 1)


def frame(text: bytes = b"words", dialect: object = mavlink) -> bytes:
    packer = dialect.MAVLink(None, srcSystem=7, srcComponent=1)  # type: ignore[attr-defined]
    if dialect is first_version:
        return bytes(first_version.MAVLink_statustext_message(4, text).pack(packer))
    return bytes(mavlink.MAVLink_statustext_message(4, text).pack(packer))


def reader(key: bytes = KEY) -> mavlink.MAVLink:
    found = mavlink.MAVLink(None)
    found.signing.secret_key = key
    found.robust_parsing = True
    return found


def types(found: mavlink.MAVLink, data: bytes) -> list[str]:
    return [one.get_type() for one in found.parse_buffer(data) or ()]


@given(key=keys, ticks=ticks, link_id=st.integers(0, 255), text=st.binary(max_size=50))
def test_the_other_implementation_takes_what_is_signed_here(key: bytes, ticks: int, link_id: int, text: bytes) -> None:
    signed = sign(frame(text), key, link_id=link_id, ticks=ticks)
    assert types(reader(key), signed) == ["STATUSTEXT"]
    assert stamp_of(signed) == (link_id, ticks)
    assert fits(signed, key) and checksum_holds(signed)
    assert without_signature(signed) == frame(text)
    assert not fits(signed, key[:-1] + bytes((key[-1] ^ 1,)))


@given(key=keys, ticks=ticks, text=st.binary(max_size=50))
def test_what_it_signs_is_taken_here(key: bytes, ticks: int, text: bytes) -> None:
    packer = mavlink.MAVLink(None, srcSystem=7, srcComponent=1)
    packer.signing.secret_key, packer.signing.timestamp, packer.signing.sign_outgoing = key, ticks, True
    signed = bytes(mavlink.MAVLink_statustext_message(4, text).pack(packer))
    assert fits(signed, key)
    assert stamp_of(signed) == (0, ticks)
    assert without_signature(signed) == frame(text)


@given(at=st.integers(0, 10_000), bit=st.integers(0, 7))
def test_no_bit_of_a_signed_frame_may_differ(at: int, bit: int) -> None:
    signed = bytearray(sign(frame(), KEY, link_id=1, ticks=5))
    signed[at % len(signed)] ^= 1 << bit
    assert not fits(bytes(signed), KEY)


def test_a_frame_of_version_1_is_signed_as_version_2() -> None:
    old = frame(dialect=first_version)
    assert old[0] == MAGIC_V1
    signed = sign(old, KEY, link_id=0, ticks=9)
    assert signed[0] == MAGIC_V2 and types(reader(), signed) == ["STATUSTEXT"]
    assert source(signed) == source(old) and payload(signed) == payload(old)


def test_an_unknown_message_is_signed_too() -> None:
    unknown = mavlink.MAVLink_message(60_000, "UNKNOWN_HERE")
    sent = bytes(unknown._pack(mavlink.MAVLink(None, srcSystem=7, srcComponent=1), 173, b"abc"))
    signed = sign(sent, KEY, link_id=0, ticks=9)
    assert fits(signed, KEY) and without_signature(signed) == sent


def test_a_signature_of_somebody_else_is_replaced() -> None:
    signed = sign(sign(frame(), OTHER, link_id=3, ticks=1), KEY, link_id=0, ticks=2)
    assert fits(signed, KEY) and not fits(signed, OTHER)
    assert len(signed) == len(frame()) + 13


def test_what_is_not_signed_stays_as_it_is() -> None:
    assert not is_signed(frame()) and not fits(frame(), KEY)
    assert without_signature(frame()) == frame()
    old = frame(dialect=first_version)
    assert not is_signed(old) and without_signature(old) == old


def test_a_time_is_never_zero_nor_longer_than_48_bits() -> None:
    assert ticks_of(0.0) == 1
    assert ticks_of(1_420_070_401.0) == 100_000
    assert ticks_of(1e12) == (1 << 48) - 1
