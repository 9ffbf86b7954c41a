"""What is inside a sealed datagram: frames, half of a keep-alive, an urgent message (docs/wire-protocol.md, 3.2)."""

from collections.abc import Sequence
from struct import Struct
from typing import Final, NamedTuple

from wire.drops import Dropped, DropReason
from wire.frames import MalformedFrame, split_frames
from wire.ids import DroneId, Epoch
from wire.sealing import LARGEST_CONTENT_BYTES

_FRAMES: Final = 1
_PING: Final = 2
_PONG: Final = 3
_URGENT: Final = 4

LARGEST_URGENT_BYTES: Final = LARGEST_CONTENT_BYTES - 1

_FRAMES_HEADER: Final = Struct("<BIII")
FRAMES_HEADER_BYTES: Final = _FRAMES_HEADER.size
_KEEPALIVE: Final = Struct("<BIQ")


class Frames(NamedTuple):
    """Whole MAVLink frames of one drone, in order, the epoch that the sender knew, and when it sent them.

    `sent_ms` is the sender's monotonic clock, milliseconds modulo 2**32 (`wire.lateness`).
    """

    drone_id: DroneId
    epoch: Epoch
    sent_ms: int
    frames: list[bytes]


class Ping(NamedTuple):
    """Asks for a Pong. `clock_us` is the sender's own clock, which means nothing to anybody else."""

    sequence: int
    clock_us: int


class Pong(NamedTuple):
    """A Ping sent back unchanged."""

    sequence: int
    clock_us: int


class Urgent(NamedTuple):
    """A message of the control channel that must not wait for a lost packet to be sent again. JSON, as it is there.

    It is sent more than once, and on the control channel too: whoever gets it counts it once.
    """

    text: bytes


Content = Frames | Ping | Pong | Urgent


def encode_urgent(text: bytes) -> bytes:
    """1 byte more than the text, which is at most LARGEST_URGENT_BYTES long. Raises ValueError if it is longer."""
    if not 0 < len(text) <= LARGEST_URGENT_BYTES:
        raise ValueError(f"an urgent message of {len(text)} bytes does not fit into a datagram")
    return bytes((_URGENT,)) + text


def encode_keepalive(content: Ping | Pong) -> bytes:
    """13 bytes."""
    kind = _PING if isinstance(content, Ping) else _PONG
    return _KEEPALIVE.pack(kind, content.sequence, content.clock_us)


def encode_frames(drone_id: DroneId, epoch: Epoch, sent_ms: int, frames: Sequence[bytes]) -> list[bytes]:
    """As few contents as the frames fit into, in order. Each frame (280 bytes at most) stays whole."""
    header = _FRAMES_HEADER.pack(_FRAMES, drone_id, epoch, sent_ms)
    contents: list[bytes] = []
    parts = [header]
    size = len(header)
    for frame in frames:
        if size + len(frame) > LARGEST_CONTENT_BYTES and len(parts) > 1:
            contents.append(b"".join(parts))
            parts = [header]
            size = len(header)
        parts.append(frame)
        size += len(frame)
    if len(parts) > 1:
        contents.append(b"".join(parts))
    return contents


def decode_content(content: bytes) -> Content:
    """Raises Dropped with BAD_CONTENT, or BAD_FRAME where the frames do not fill it exactly."""
    kind = content[0] if content else 0
    if kind == _FRAMES:
        if len(content) <= _FRAMES_HEADER.size:
            raise Dropped(DropReason.BAD_CONTENT)
        _, drone_id, epoch, sent_ms = _FRAMES_HEADER.unpack_from(content)
        try:
            frames = split_frames(content, _FRAMES_HEADER.size)
        except MalformedFrame:
            raise Dropped(DropReason.BAD_FRAME) from None
        return Frames(DroneId(drone_id), Epoch(epoch), sent_ms, frames)
    if kind in (_PING, _PONG) and len(content) == _KEEPALIVE.size:
        _, sequence, clock_us = _KEEPALIVE.unpack(content)
        return Ping(sequence, clock_us) if kind == _PING else Pong(sequence, clock_us)
    if kind == _URGENT and len(content) > 1:
        return Urgent(content[1:])
    raise Dropped(DropReason.BAD_CONTENT)
