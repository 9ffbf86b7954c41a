"""Frames under another system id: for programs that have several vehicles on one line."""

from __future__ import annotations

from fastcrc.crc16 import mcrf4xx as _crc16

from wire.frame_signing import without_signature
from wire.frames import MAGIC_V2
from wire.own_system import target_offset


def readdressed(frame: bytes, *, sender: int | None = None, target: int | None = None) -> bytes:
    """Returns a whole frame from the system `sender`, or to the system `target` if it has an addressee; None: as it is.

    Its checksum is as right or wrong as before, also for a message that the dialect lacks: the checksum of a difference
    is the difference of the checksums. A signature, which would no longer fit, is left out.
    """
    frame = without_signature(frame)
    start = 10 if frame[0] == MAGIC_V2 else 6
    end = start + frame[1]
    changed = bytearray(frame)
    if sender is not None:
        changed[5 if frame[0] == MAGIC_V2 else 3] = sender
    offset = target_offset(frame)
    if target is not None and offset is not None and start + offset < end:
        changed[start + offset] = target
    difference = bytes(old ^ new for old, new in zip(frame[1:end], changed[1:end], strict=True))
    checksum = _crc16(difference + b"\0", 0)
    changed[end] ^= checksum & 0xFF
    changed[end + 1] ^= checksum >> 8
    return bytes(changed)
