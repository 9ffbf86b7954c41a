"""Frames are found in a byte stream with arbitrary splits and noise, and are never changed."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.dialect import CRC_EXTRA, build, decode, mavlink
from wire.frame_stream import FrameStream
from wire.frames import (
    MAX_FRAME_BYTES,
    MalformedFrame,
    checksum_holds,
    frame_length,
    is_known,
    message_id,
    payload,
    source,
    split_frames,
)


def packed(*, signed: bool = False, version_1: bool = False) -> bytes:
    packer = mavlink.MAVLink(None, srcSystem=3, srcComponent=4)
    if signed:
        packer.signing.secret_key = b"k" * 32
        packer.signing.sign_outgoing = True
        packer.signing.timestamp = 1
    message = mavlink.MAVLink_attitude_message(77, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    return bytes(message.pack(packer, force_mavlink1=version_1))


V2 = packed()
SIGNED = packed(signed=True)
V1 = packed(version_1=True)
LONGEST = build(
    mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, [255] * 251), system_id=1, component_id=1, sequence=0
)
UNKNOWN_ID = 60_000
UNKNOWN = bytes([0xFD, 2, 0, 0, 1, 1, 1, UNKNOWN_ID & 0xFF, UNKNOWN_ID >> 8, 0, 5, 6, 9, 9])
KINDS = {"v2": V2, "signed": SIGNED, "v1": V1, "longest": LONGEST}


@pytest.mark.parametrize("frame", KINDS.values(), ids=KINDS)
def test_the_header_says_everything(frame: bytes) -> None:
    assert frame_length(frame) == len(frame)
    assert checksum_holds(frame)
    assert is_known(frame)
    assert split_frames(frame + frame) == [frame, frame]


def test_what_is_read_off_a_frame() -> None:
    for frame in (V2, SIGNED, V1):
        assert message_id(frame) == mavlink.MAVLINK_MSG_ID_ATTITUDE
        assert source(frame) == (3, 4)
        assert payload(frame) == payload(V2)


@pytest.mark.parametrize("frame", KINDS.values(), ids=KINDS)
def test_cut_at_every_byte(frame: bytes) -> None:
    both = frame + V2
    for cut in range(1, len(both)):
        stream = FrameStream()
        assert stream.feed(both[:cut]) + stream.feed(both[cut:]) == [frame, V2]
        assert stream.skipped_bytes == 0


frames = st.sampled_from([V2, SIGNED, V1])
noise = st.binary(max_size=40).map(lambda raw: bytes(byte for byte in raw if byte not in (0xFD, 0xFE)))


@given(st.lists(st.tuples(noise, frames), max_size=8), st.lists(st.integers(0, 600), max_size=8))
def test_all_frames_are_found_between_noise(parts: list[tuple[bytes, bytes]], cuts: list[int]) -> None:
    data = b"".join(before + frame for before, frame in parts)
    edges = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    stream = FrameStream()
    found = [frame for a, b in pairwise(edges) for frame in stream.feed(data[a:b])]
    assert found == [frame for _, frame in parts]
    assert stream.skipped_bytes == sum(len(before) for before, _ in parts)


@given(st.lists(st.binary(max_size=400), max_size=6))
def test_random_bytes_never_raise_and_never_grow_the_buffer(chunks: list[bytes]) -> None:
    stream = FrameStream()
    for chunk in chunks:
        for frame in stream.feed(chunk):
            assert frame_length(frame) == len(frame)
            assert checksum_holds(frame) or not is_known(frame)
    assert len(stream._buffer) < MAX_FRAME_BYTES


@pytest.mark.parametrize("frame", [V2, SIGNED, V1], ids=["v2", "signed", "v1"])
def test_a_flipped_bit_is_no_frame(frame: bytes) -> None:
    before_signature = len(frame) - (13 if frame is SIGNED else 0)
    for at in range(before_signature):
        spoiled = bytearray(frame)
        spoiled[at] ^= 0x10
        assert FrameStream().feed(bytes(spoiled) + bytes(MAX_FRAME_BYTES)) == [], f"byte {at}"


def test_noise_that_looks_like_a_header_does_not_swallow_what_follows() -> None:
    stream = FrameStream()
    found = stream.feed(b"\xfd\xff\x00" + V2 * 20)
    assert found[-1] == V2
    assert len(found) == 20


def test_an_unknown_message_passes_where_a_frame_may_end_only() -> None:
    assert UNKNOWN_ID not in CRC_EXTRA
    assert FrameStream().feed(UNKNOWN) == [UNKNOWN]
    assert FrameStream().feed(UNKNOWN + V2) == [UNKNOWN, V2]
    stream = FrameStream()
    assert stream.feed(UNKNOWN + b"\x00" + V2) == [V2]
    assert stream.unknown_frames == 0


def test_an_unknown_incompatibility_flag_is_refused() -> None:
    with pytest.raises(MalformedFrame):
        frame_length(b"\xfd\x00\x02")
    assert FrameStream().feed(b"\xfd\x09\x02" + V2) == [V2]


@given(st.binary(min_size=1, max_size=300))
def test_split_frames_raises_nothing_but_its_own(data: bytes) -> None:
    try:
        found = split_frames(data)
    except MalformedFrame:
        return
    assert b"".join(found) == data


@given(st.sampled_from(sorted(CRC_EXTRA)), st.binary(max_size=255))
def test_decode_never_raises_on_a_frame_whose_checksum_holds(msgid: int, body: bytes) -> None:
    header = bytes([len(body), 0, 0, 1, 1, 1]) + msgid.to_bytes(3, "little")
    crc = mavlink.x25crc(header + body + bytes([CRC_EXTRA[msgid]])).crc
    frame = b"\xfd" + header + body + crc.to_bytes(2, "little")
    assert checksum_holds(frame)
    message = decode(frame)
    assert message is None or message.get_msgId() == msgid
