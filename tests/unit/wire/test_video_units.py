"""The video unit: encoding and decoding are inverse, and nothing else is accepted."""

import struct
from dataclasses import dataclass

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.control_messages import decode_to_agent, decode_to_tower, encode_message
from wire.video import (
    HEADER_BYTES,
    MAX_UNIT_BYTES,
    CameraState,
    ClockAnswer,
    ClockProbe,
    Codec,
    Got,
    KeyWanted,
    MalformedUnit,
    Quality,
    StreamRequest,
    Unit,
    VideoState,
    VideoWanted,
    decode_got,
    decode_unit,
    encode_got,
    encode_unit,
    with_capture_time,
)

U16, U32, U64 = (1 << 16) - 1, (1 << 32) - 1, (1 << 64) - 1

units = st.builds(
    Unit,
    quality=st.sampled_from(Quality),
    codec=st.sampled_from(Codec),
    sequence=st.integers(0, U32),
    key=st.booleans(),
    is_break=st.booleans(),
    capture_us=st.integers(0, U64),
    width=st.integers(1, U16),
    height=st.integers(1, U16),
    rate_hz=st.integers(1, U16).map(lambda centi: centi / 100),
    bits_per_s=st.integers(0, U32),
    held_ms=st.integers(0, U16),
    payload=st.binary(min_size=1, max_size=400),
)


@given(units)
def test_what_goes_in_comes_out(unit: Unit) -> None:
    assert decode_unit(encode_unit(unit)) == unit


@given(units, st.integers(0, U64))
def test_another_clock_changes_nothing_else(unit: Unit, capture_us: int) -> None:
    assert decode_unit(with_capture_time(encode_unit(unit), capture_us)) == unit._replace(capture_us=capture_us)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_unit_or_refused(message: bytes) -> None:
    try:
        unit = decode_unit(message)
    except MalformedUnit:
        return
    assert encode_unit(unit) == message


@dataclass(frozen=True)
class Spoilt:
    at: int
    value: int


@pytest.mark.parametrize(
    "spoilt", [Spoilt(0, 2), Spoilt(1, 4), Spoilt(2, 9), Spoilt(3, 0), Spoilt(3, 3)], ids=lambda one: f"byte{one.at}"
)
def test_what_is_not_known_is_refused(spoilt: Spoilt) -> None:
    unit = Unit(Quality.LOW, Codec.MPEG1, 1, True, False, 5, 320, 240, 24.0, 1, 0, b"x")
    message = bytearray(encode_unit(unit))
    message[spoilt.at] = spoilt.value
    with pytest.raises(MalformedUnit):
        decode_unit(bytes(message))


def test_sizes_have_bounds() -> None:
    unit = Unit(Quality.LOW, Codec.MPEG1, 1, True, False, 5, 320, 240, 24.0, 1, 0, b"")
    for payload in (b"", bytes(MAX_UNIT_BYTES - HEADER_BYTES + 1)):
        with pytest.raises(MalformedUnit):
            decode_unit(encode_unit(unit._replace(payload=payload)))
    with pytest.raises(MalformedUnit):
        decode_unit(encode_unit(unit._replace(payload=b"x", width=0)))
    with pytest.raises(struct.error):
        encode_unit(unit._replace(width=1 << 16))


def test_an_answer_about_a_unit() -> None:
    got = Got(Quality.HIGH, Codec.H264, 77)
    assert decode_got(encode_got(got)) == got
    for wrong in (b"", encode_got(got) + b"x", b"\x09" + encode_got(got)[1:]):
        with pytest.raises(MalformedUnit):
            decode_got(wrong)


def test_the_messages_of_the_control_channel() -> None:
    wanted = VideoWanted(ticket="t", streams=(StreamRequest(Quality.MEDIUM, Codec.MPEG1),))
    assert decode_to_agent(encode_message(wanted)) == wanted
    assert decode_to_agent(encode_message(ClockProbe(number=3))) == ClockProbe(number=3)
    for reported in (VideoState(camera=CameraState.LOST, words="unplugged"), ClockAnswer(number=3, at_us=1 << 50)):
        assert decode_to_tower(encode_message(reported)) == reported
    assert msgspec.json.decode(encode_message(wanted))["streams"] == [{"quality": 1, "codec": 1}]


def test_the_request_for_a_key_picture() -> None:
    message = msgspec.json.encode(KeyWanted(Quality.MEDIUM, Codec.H264))
    assert message == b'{"type":"key","quality":1,"codec":2}'
    assert msgspec.json.decode(message, type=KeyWanted) == KeyWanted(Quality.MEDIUM, Codec.H264)
