"""Tagged frames: the binary messages between browser and tower. A tag (drone id, u32) precedes each frame."""

from collections.abc import Iterable
from struct import Struct
from typing import Final

from wire.frames import MalformedFrame, frame_length
from wire.ids import DroneId

NO_DRONE: Final = 0
"""The tag of a stamp: the sender's clock follows instead of a frame (`wire.lateness`), 4 bytes."""

MAX_UPWARD_MESSAGE_BYTES: Final = 16 * 1024
"""The limit for one message of a browser: sticks at 50 Hz and a mission item are far below it."""

_TAG: Final = Struct("<I")
TAG_BYTES: Final = _TAG.size


def tag(drone_id: DroneId, frame: bytes) -> bytes:
    """Returns one tagged frame."""
    return _TAG.pack(drone_id) + frame


def join(tagged_frames: Iterable[bytes]) -> bytes:
    """Returns one binary message of tagged frames."""
    return b"".join(tagged_frames)


def stamp(sent_ms: int) -> bytes:
    """Returns the stamp at the head of a browser's message, by which the tower measures its delay."""
    return _TAG.pack(NO_DRONE) + _TAG.pack(sent_ms)


def split_stamp(message: bytes) -> tuple[int | None, bytes]:
    """Splits a binary message into (stamp or None, the tagged frames behind it)."""
    if len(message) >= 2 * TAG_BYTES and message[:TAG_BYTES] == b"\0\0\0\0":
        return _TAG.unpack_from(message, TAG_BYTES)[0], message[2 * TAG_BYTES :]
    return None, message


def split_tagged(message: bytes) -> list[tuple[DroneId, bytes]]:
    """Returns the tagged frames of a binary message, in order.

    Raises MalformedFrame unless they fill the message to its last byte; an empty message is malformed.
    """
    parts: list[tuple[DroneId, bytes]] = []
    offset = 0
    end = len(message)
    while True:
        if end - offset <= TAG_BYTES:
            raise MalformedFrame("a tag with no frame behind it")
        (drone_id,) = _TAG.unpack_from(message, offset)
        offset += TAG_BYTES
        length = frame_length(message, offset)
        if length == 0 or offset + length > end:
            raise MalformedFrame("a frame is cut off")
        parts.append((DroneId(drone_id), message[offset : offset + length]))
        offset += length
        if offset == end:
            return parts
