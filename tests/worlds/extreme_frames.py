"""Frames with extreme values in every field: what an autopilot with a broken estimator, or a hostile one, may send."""

from __future__ import annotations

import struct
from typing import Final

from hypothesis import strategies as st

from wire.dialect import mavlink

_WORDS: Final = (
    bytes(4),
    b"\xff" * 4,
    struct.pack("<i", 2**31 - 1),
    struct.pack("<i", -(2**31)),
    struct.pack("<f", float("nan")),
    struct.pack("<f", float("inf")),
    struct.pack("<f", float("-inf")),
    struct.pack("<f", 3.4e38),
    struct.pack("<i", 950_000_000),  # 95 degrees
    struct.pack("<i", -1_900_000_000),
    struct.pack("<hh", -32768, 32767),
)
"""MAVLink puts wide fields first, so that each field of four bytes is one of these."""


def frame_of(number: int, payload: bytes, *, system_id: int = 1, component_id: int = 1) -> bytes:
    """A whole frame of version 2 with this payload."""
    header = bytes([len(payload), 0, 0, 0, system_id, component_id]) + number.to_bytes(3, "little")
    crc = mavlink.x25crc(header + payload + bytes([mavlink.mavlink_map[number].crc_extra])).crc
    return b"\xfd" + header + payload + crc.to_bytes(2, "little")


@st.composite
def extreme_frames(draw: st.DrawFn, numbers: st.SearchStrategy[int], *, component_id: int = 1) -> bytes:
    """One frame of a drawn message: each word of the payload is extreme, or random."""
    number = draw(numbers)
    size: int = mavlink.mavlink_map[number].unpacker.size
    words = draw(
        st.lists(st.one_of(st.sampled_from(_WORDS), st.binary(min_size=4, max_size=4)), min_size=1, max_size=8)
    )
    payload = b"".join(words[at % len(words)] for at in range(size // 4 + 1))[:size]
    return frame_of(number, payload, component_id=component_id)
