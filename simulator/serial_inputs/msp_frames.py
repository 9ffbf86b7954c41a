"""MultiWii Serial Protocol, versions 1 and 2: frames of requests, answers and errors.

Version 1: `$M`, direction, size, function, payload, and the XOR of all from the size on. Sizes of 255 and more follow
in a 16-bit word ("jumbo"). Version 2: `$X`, direction, flags, 16-bit function, 16-bit size, payload, CRC-8 DVB-S2.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from functools import reduce

MAX_PAYLOAD = 1024
"""A flight controller has no room for more; a larger frame is skipped."""
_JUMBO = 255


class Direction(IntEnum):
    REQUEST = ord("<")
    ANSWER = ord(">")
    ERROR = ord("!")


@dataclass(frozen=True, slots=True)
class MspFrame:
    version: int
    direction: Direction
    function: int
    payload: bytes = b""
    flags: int = 0
    """Of version 2."""


def _dvb_s2_table() -> tuple[int, ...]:
    table = []
    for value in range(256):
        crc = value
        for _ in range(8):
            crc = (crc << 1) ^ 0xD5 if crc & 0x80 else crc << 1
        table.append(crc & 0xFF)
    return tuple(table)


_CRC = _dvb_s2_table()


def crc8_dvb_s2(data: bytes) -> int:
    return reduce(lambda crc, byte: _CRC[crc ^ byte], data, 0)


def xor(data: bytes | bytearray) -> int:
    return reduce(lambda total, byte: total ^ byte, data, 0)


def encode(frame: MspFrame) -> bytes:
    """Raises ValueError for what has no room in a frame of its version."""
    size = len(frame.payload)
    if size > MAX_PAYLOAD or not 0 <= frame.function <= (0xFF if frame.version == 1 else 0xFFFF):
        raise ValueError("no such frame")
    if frame.version == 1:
        jumbo = struct.pack("<H", size) if size >= _JUMBO else b""
        body = bytes((min(size, _JUMBO), frame.function)) + jumbo + frame.payload
        return b"$M" + bytes((frame.direction,)) + body + bytes((xor(body),))
    body = struct.pack("<BHH", frame.flags, frame.function, size) + frame.payload
    return b"$X" + bytes((frame.direction,)) + body + bytes((crc8_dvb_s2(body),))


class MspDecoder:
    """Takes bytes in any portions. Holds back at most one frame, so at most `MAX_PAYLOAD` and its head."""

    def __init__(self) -> None:
        self._waiting = bytearray()
        self.bad_frames = 0
        """Whose checksum or size was wrong."""

    def receive(self, data: bytes) -> list[MspFrame]:
        frames: list[MspFrame] = []
        self._waiting += data
        while True:
            start = self._waiting.find(b"$")
            if start < 0:
                self._waiting.clear()
                return frames
            del self._waiting[:start]
            frame, used = _first(self._waiting)
            if used == 0:
                return frames
            if frame is None:
                self.bad_frames += used < 0
                del self._waiting[:1]  # not a frame: look for the next "$" behind this one
            else:
                frames.append(frame)
                del self._waiting[:used]


def _first(data: bytearray) -> tuple[MspFrame | None, int]:
    """Returns the frame at the start of `data` and its length; None with 0 if more bytes are needed, with a positive
    number if nothing begins here, and with a negative one if a frame is damaged."""
    if len(data) < 3:
        return None, 0 if bytes(data) in (b"$", b"$M", b"$X") else 1
    if data[1] not in b"MX" or data[2] not in set(Direction):
        return None, 1
    return _version_1(data) if data[1] == ord("M") else _version_2(data)


def _version_1(data: bytearray) -> tuple[MspFrame | None, int]:
    head = 5
    if len(data) < head:
        return None, 0
    size = data[3]
    if size == _JUMBO:
        head = 7
        if len(data) < head:
            return None, 0
        size = int.from_bytes(data[5:7], "little")
    if size > MAX_PAYLOAD:
        return None, -1
    end = head + size
    if len(data) <= end:
        return None, 0
    if xor(data[3:end]) != data[end]:
        return None, -1
    return MspFrame(1, Direction(data[2]), data[4], bytes(data[head:end])), end + 1


def _version_2(data: bytearray) -> tuple[MspFrame | None, int]:
    head = 8
    if len(data) < head:
        return None, 0
    flags, function, size = struct.unpack_from("<BHH", data, 3)
    if size > MAX_PAYLOAD:
        return None, -1
    end = head + size
    if len(data) <= end:
        return None, 0
    if crc8_dvb_s2(bytes(data[3:end])) != data[end]:
        return None, -1
    return MspFrame(2, Direction(data[2]), function, bytes(data[head:end]), flags), end + 1
