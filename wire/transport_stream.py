"""Takes the video out of MPEG-TS packets, as MPEG-1 units carry them (ISO/IEC 13818-1, 2.4.3). Pure."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Final

PACKET_BYTES: Final = 188
_SYNC: Final = 0x47
_VIDEO_IDS: Final = range(0xE0, 0xF0)
_PICTURE: Final = 0x00
_HEADERS: Final = (0xB3, 0xB8)
"""Sequence and group: they belong to the picture behind them."""
_PICTURE_START: Final = re.compile(rb"\x00\x00\x01([\x00\xb3\xb8])")


class MalformedPackets(ValueError):
    """The bytes are no transport stream."""


def video_in(packets: bytes) -> bytes:
    """The elementary stream in whole packets: their video, whatever its PID is. Raises MalformedPackets."""
    if len(packets) % PACKET_BYTES:
        raise MalformedPackets(f"{len(packets)} bytes are no whole packets")
    video: int | None = None
    found = bytearray()
    for start in range(0, len(packets), PACKET_BYTES):
        packet = packets[start : start + PACKET_BYTES]
        if packet[0] != _SYNC:
            raise MalformedPackets("a packet does not begin as one")
        begins, pid = bool(packet[1] & 0x40), (packet[1] & 0x1F) << 8 | packet[2]
        adaptation = packet[3] >> 4 & 3
        at = 4 if adaptation == 1 else 5 + packet[4]
        if not adaptation & 1 or at >= PACKET_BYTES:
            continue
        payload = packet[at:]
        if begins and payload[:3] == b"\x00\x00\x01" and len(payload) > 9 and payload[3] in _VIDEO_IDS:
            video = pid
            payload = payload[9 + payload[8] :]
        if pid == video:
            found += payload
    return bytes(found)


def pictures_in(stream: bytes) -> list[bytes]:
    """Each picture with the headers before it."""
    cuts: list[int] = []
    opened = False
    """Headers of the next picture have begun."""
    for found in _PICTURE_START.finditer(stream):
        if not opened:
            cuts.append(found.start())
        opened = found[1][0] in _HEADERS
    pieces = [stream[cut:end] for cut, end in pairwise([*cuts, len(stream)])]
    return pieces[:-1] if opened else pieces  # headers without a picture
