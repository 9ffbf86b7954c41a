"""MAVLink 2 signatures: 13 bytes behind a frame that only an owner of the key can make (no I/O).

As in the MAVLink guide on message signing: a link id, 48 bits of time in units of 10 µs since 2015-01-01, and the first
6 bytes of the SHA-256 over key, frame, link id and time.
"""

from hashlib import sha256
from hmac import compare_digest
from typing import Final

from fastcrc.crc16 import mcrf4xx as _crc16

from wire.dialect import CRC_EXTRA
from wire.frames import MAGIC_V1, MAGIC_V2, SIGNATURE_BYTES, SIGNED, message_id

KEY_BYTES: Final = 32
TICKS_PER_S: Final = 100_000
MAX_TICKS: Final = (1 << 48) - 1
_EPOCH_UNIX_S: Final = 1_420_070_400
_HASH_BYTES: Final = 6


def ticks_of(unix_s: float) -> int:
    """Returns a time of day in the units of signatures, at least 1."""
    return min(max(int((unix_s - _EPOCH_UNIX_S) * TICKS_PER_S), 1), MAX_TICKS)


def is_signed(frame: bytes) -> bool:
    """Returns whether a whole frame carries a signature, whoever made it."""
    return frame[0] == MAGIC_V2 and bool(frame[2] & SIGNED)


def sign(frame: bytes, key: bytes, *, link_id: int, ticks: int) -> bytes:
    """Returns a whole frame with this signature in place of any other. Frames of version 1 become version 2."""
    body = bytearray(_body(frame))
    body[2] |= SIGNED
    stamp = bytes((link_id,)) + ticks.to_bytes(6, "little")
    signed = _with_checksum(body, _seed(frame)) + stamp
    return signed + sha256(key + signed).digest()[:_HASH_BYTES]


def fits(frame: bytes, key: bytes) -> bool:
    """Returns whether a whole frame carries a signature by this key."""
    if not is_signed(frame):
        return False
    return compare_digest(sha256(key + frame[:-_HASH_BYTES]).digest()[:_HASH_BYTES], frame[-_HASH_BYTES:])


def stamp_of(signed: bytes) -> tuple[int, int]:
    """Returns (link id, ticks) of a signed frame."""
    return signed[-SIGNATURE_BYTES], int.from_bytes(signed[-SIGNATURE_BYTES + 1 : -_HASH_BYTES], "little")


def without_signature(frame: bytes) -> bytes:
    """Returns a whole frame as it would be without a signature."""
    if not is_signed(frame):
        return frame
    body = bytearray(_body(frame))
    body[2] &= ~SIGNED
    return _with_checksum(body, _seed(frame))


def with_payload(frame: bytes, payload: bytes) -> bytes:
    """Returns a whole frame of version 2 with another payload, and without a signature."""
    body = bytearray(_body(frame)[:10])
    body[1] = len(payload)
    body[2] &= ~SIGNED
    return _with_checksum(body + payload, _seed(frame))


def _body(frame: bytes) -> bytes:
    """From the first byte to the end of the payload, as version 2."""
    if frame[0] == MAGIC_V1:
        _, length, sequence, system, component, message = frame[:6]
        return bytes((MAGIC_V2, length, 0, 0, sequence, system, component, message, 0, 0)) + frame[6 : 6 + length]
    return frame[: 10 + frame[1]]


def _with_checksum(body: bytearray, seed: int) -> bytes:
    crc = _crc16(bytes(body[1:]) + bytes((seed,)))
    return bytes(body) + crc.to_bytes(2, "little")


def _seed(frame: bytes) -> int:
    """The seed of the message's checksum. Of one that the dialect lacks only one seed makes the checksum right."""
    known = CRC_EXTRA.get(message_id(frame))
    if known is not None:
        return known
    end = (6 if frame[0] == MAGIC_V1 else 10) + frame[1]
    checksum = int.from_bytes(frame[end : end + 2], "little")
    return next(seed for seed in range(256) if _crc16(frame[1:end] + bytes((seed,))) == checksum)
