"""Where a MAVLink frame begins and ends, who sent it, and whether it is whole.

A frame is bytes and stays bytes: nothing here re-packs it, so a signature stays valid and the receiver gets what was
sent. The layouts are those of the MAVLink serialization guide:

    version 1: FE len seq sysid compid msgid payload crc16
    version 2: FD len incompat compat seq sysid compid msgid(3) payload crc16 [signature(13)]
"""

from typing import Final

from fastcrc.crc16 import mcrf4xx as _crc16

from wire.dialect import CRC_EXTRA

MAGIC_V1: Final = 0xFE
MAGIC_V2: Final = 0xFD
SIGNED: Final = 0x01
SIGNATURE_BYTES: Final = 13
MIN_FRAME_BYTES: Final = 8
MAX_FRAME_BYTES: Final = 12 + 255 + SIGNATURE_BYTES


class MalformedFrame(ValueError):
    """The bytes are not a MAVLink frame. Raised only for received bytes, never for incorrect use of this module."""


def frame_length(buffer: bytes, offset: int = 0) -> int:
    """Returns the length of the frame at `offset`, from its header; 0 if the header is not complete yet.

    Raises MalformedFrame if no frame can begin there: a wrong first byte, or an incompatibility flag that the MAVLink
    guide requires a reader to refuse.
    """
    available = len(buffer) - offset
    if available < 1:
        return 0
    magic = buffer[offset]
    if magic == MAGIC_V2:
        if available < 3:
            return 0
        incompat = buffer[offset + 2]
        if incompat & ~SIGNED:
            raise MalformedFrame("incompatibility flags that nobody knows")
        return buffer[offset + 1] + (12 + SIGNATURE_BYTES if incompat else 12)
    if magic == MAGIC_V1:
        return 0 if available < 2 else buffer[offset + 1] + 8
    raise MalformedFrame("not the first byte of a MAVLink frame")


def message_id(frame: bytes) -> int:
    """Returns the message id of a whole frame."""
    if frame[0] == MAGIC_V2:
        return frame[7] | frame[8] << 8 | frame[9] << 16
    return frame[5]


def source(frame: bytes) -> tuple[int, int]:
    """Returns (sysid, compid) of a whole frame's sender."""
    return (frame[5], frame[6]) if frame[0] == MAGIC_V2 else (frame[3], frame[4])


def payload(frame: bytes) -> bytes:
    """Returns the payload as sent: in version 2 trailing zeros may be missing."""
    start = 10 if frame[0] == MAGIC_V2 else 6
    return frame[start : start + frame[1]]


def is_known(frame: bytes) -> bool:
    """Returns whether the dialect has this message, so that its checksum can be verified."""
    return message_id(frame) in CRC_EXTRA


def checksum_holds(frame: bytes) -> bool:
    """Returns whether the checksum of a whole frame is valid. False for a message that the dialect lacks."""
    extra = CRC_EXTRA.get(message_id(frame))
    if extra is None:
        return False
    end = (10 if frame[0] == MAGIC_V2 else 6) + frame[1]
    return _crc16(frame[1:end] + bytes((extra,))) == frame[end] | frame[end + 1] << 8


def split_frames(buffer: bytes, offset: int = 0) -> list[bytes]:
    """Splits the consecutive frames from `offset` to the last byte. At least one.

    Raises MalformedFrame unless they fill it exactly. Checksums are not verified.
    """
    frames: list[bytes] = []
    end = len(buffer)
    while True:
        # Nearly all frames are version 2 without a signature. They are measured inline: this is the hottest loop.
        if end - offset >= 12 and buffer[offset] == MAGIC_V2 and not buffer[offset + 2]:
            after = offset + buffer[offset + 1] + 12
        else:
            length = frame_length(buffer, offset)
            after = offset + length if length else end + 1
        if after > end:
            raise MalformedFrame("a frame is cut off")
        frames.append(buffer[offset:after])
        if after == end:
            return frames
        offset = after
