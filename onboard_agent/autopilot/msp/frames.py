"""MultiWii Serial Protocol, versions 1 and 2: encoding and decoding of frames. Pure.

Version 1 is `$M`, direction, size, function, payload, XOR. A size of 255 announces one of 16 bits ("jumbo"). Version 2
is `$X`, direction, flags, function (16 bit), size (16 bit), payload, CRC-8/DVB-S2. All little endian.
"""

from __future__ import annotations

from functools import reduce
from operator import xor
from struct import Struct
from typing import Final, NamedTuple

REQUEST: Final = ord("<")
ANSWER: Final = ord(">")
ERROR: Final = ord("!")
MAX_PAYLOAD_BYTES: Final = 2048
"""Longer than any answer that is read here; a frame that claims more is noise."""
_JUMBO: Final = 255
_V2: Final = Struct("<BHH")


class MspMessage(NamedTuple):
    """`direction`: REQUEST, ANSWER or ERROR (the function is not known there, or its payload makes no sense)."""

    version: int
    direction: int
    function: int
    payload: bytes = b""


def _crc_of(byte: int) -> int:
    for _ in range(8):
        byte = byte << 1 ^ (0xD5 if byte & 0x80 else 0)
    return byte & 0xFF


_CRC: Final = tuple(map(_crc_of, range(256)))


def crc8(data: bytes) -> int:
    """CRC-8/DVB-S2."""
    return reduce(lambda crc, byte: _CRC[crc ^ byte], data, 0)


def encode(message: MspMessage) -> bytes:
    """Returns the frame. Raises ValueError if version 1 has no room for the function, or the payload is too long."""
    version, direction, function, payload = message
    size = len(payload)
    if size > MAX_PAYLOAD_BYTES or function > (0xFF if version == 1 else 0xFFFF):
        raise ValueError(f"no frame of version {version} for function {function} with {size} bytes")
    if version == 1:
        long_size = size.to_bytes(2, "little") if size >= _JUMBO else b""
        body = bytes((min(size, _JUMBO), function)) + long_size + payload
        return b"$M%c%b%c" % (direction, body, reduce(xor, body))
    body = _V2.pack(0, function, size) + payload
    return b"$X%c%b%c" % (direction, body, crc8(body))


class MspReader:
    """Finds frames in a stream. Keeps less than one frame."""

    def __init__(self) -> None:
        self._buffer = b""
        self.damaged = 0
        """Frames with a wrong checksum."""

    def feed(self, data: bytes) -> list[MspMessage]:
        """Returns the frames that are complete now. Skips everything else."""
        buffer, offset, found = self._buffer + data, 0, list[MspMessage]()
        while (offset := buffer.find(b"$", offset)) >= 0:
            length, message = self._frame(buffer, offset)
            if length is None:
                break  # incomplete
            if message is not None:
                found.append(message)
            offset += length
        self._buffer = b"" if offset < 0 else buffer[offset:]
        return found

    def _frame(self, buffer: bytes, start: int) -> tuple[int | None, MspMessage | None]:
        """Returns how much to skip, None if more bytes are needed, and the frame that begins at `start`, if any."""
        head = buffer[start : start + 8]
        if len(head) < 3:
            return None if head in (b"$", b"$M", b"$X") else 1, None
        kind, direction = head[1:2], head[2]
        if kind not in (b"M", b"X") or direction not in (REQUEST, ANSWER, ERROR):
            return 1, None
        needed = 5 if kind == b"M" else 8
        if kind == b"M" and len(head) >= 5 and head[3] == _JUMBO:
            needed = 7
        if len(head) < needed:
            return None, None
        if kind == b"M":
            function = head[4]
            size = head[3] if needed == 5 else int.from_bytes(head[5:7], "little")
        else:
            _, function, size = _V2.unpack_from(head, 3)
        if size > MAX_PAYLOAD_BYTES:
            return 1, None
        end = start + needed + size
        if len(buffer) <= end:
            return None, None
        body = buffer[start + 3 : end]
        if (reduce(xor, body) if kind == b"M" else crc8(body)) != buffer[end]:
            self.damaged += 1
            return 1, None
        payload = buffer[start + needed : end]
        return end + 1 - start, MspMessage(1 if kind == b"M" else 2, direction, function, payload)
