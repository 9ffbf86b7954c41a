"""Tagged frames: the binary messages between browser and tower. A tag (drone id, u32) before each frame."""

from collections.abc import Iterable
from struct import Struct
from typing import Final

from wire.frames import MalformedFrame, frame_length
from wire.ids import DroneId

NO_DRONE: Final = 0
"""The tag of a stamp: what follows is not a frame but the sender's clock (`wire.lateness`), 4 bytes."""

MAX_UPWARD_MESSAGE_BYTES: Final = 16 * 1024
"""What a browser may send in one message: sticks at 50 Hz and a mission item are far below it."""

_TAG: Final = Struct("<I")
TAG_BYTES: Final = _TAG.size


def tag(drone_id: DroneId, frame: bytes) -> bytes:
    """One tagged frame."""
    return _TAG.pack(drone_id) + frame


def join(tagged_frames: Iterable[bytes]) -> bytes:
    """One binary message of tagged frames."""
    return b"".join(tagged_frames)


def stamp(sent_ms: int) -> bytes:
    """What a browser puts first into a message, so that the tower can see how late it comes."""
    return _TAG.pack(NO_DRONE) + _TAG.pack(sent_ms)


def split_stamp(message: bytes) -> tuple[int | None, bytes]:
    """(stamp or None, the tagged frames behind it) of a binary message."""
    if len(message) >= 2 * TAG_BYTES and message[:TAG_BYTES] == b"\0\0\0\0":
        return _TAG.unpack_from(message, TAG_BYTES)[0], message[2 * TAG_BYTES :]
    return None, message


def split_tagged(message: bytes) -> list[tuple[DroneId, bytes]]:
    """The tagged frames of a binary message, in order.

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
