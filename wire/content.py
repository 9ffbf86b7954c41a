"""The content of a sealed datagram: frames (with or without a ping), a ping, a pong, or an urgent message.

The layouts are in docs/wire-protocol.md, 3.2.
"""

from collections.abc import Sequence
from enum import IntEnum
from struct import Struct
from typing import Final, NamedTuple

from wire.drops import Dropped, DropReason
from wire.frames import MalformedFrame, split_frames
from wire.ids import DroneId, Epoch
from wire.sealing import MAX_CONTENT_BYTES

_FRAMES: Final = 1
_URGENT: Final = 4
_PING: Final = 7
_PONG: Final = 8
_PING_AND_FRAMES: Final = 9

MAX_URGENT_BYTES: Final = MAX_CONTENT_BYTES - 1

_FRAMES_HEADER: Final = Struct("<BIII")
FRAMES_HEADER_BYTES: Final = _FRAMES_HEADER.size
_PING_FIXED: Final = Struct("<BIQQBBIB")
_PONG_FIXED: Final = Struct("<BIQQ")
PING_BYTES: Final = _PING_FIXED.size
LOST_OF: Final = 255
"""Loss is reported in units of 1/255."""


class Frames(NamedTuple):
    """Whole MAVLink frames of one drone, in order, with the epoch known to the sender and the time of sending.

    `sent_ms`: the sender's monotonic clock, milliseconds modulo 2**32 (`wire.lateness`). `ping`: a ping in the same
    datagram.
    """

    drone_id: DroneId
    epoch: Epoch
    sent_ms: int
    frames: list[bytes]
    ping: "Ping | None" = None


class Report(NamedTuple):
    """What the sender has received of the other direction since the link began: the receiver computes the loss.

    `expected`: the highest counter received, plus one. `received`: the number of different datagrams received.
    """

    expected: int = 0
    received: int = 0


class Purpose(IntEnum):
    """Where the answer to a ping goes, and whether the other side follows its address."""

    KEEPALIVE = 0
    """Sent and answered on the path in use."""
    PROBE = 1
    """Tests a path: answered to its source address, which is not followed."""
    UPLINK = 2
    """Like a probe; also reports the address of one of several uplinks."""


_PURPOSES: Final = tuple(Purpose)


class Ping(NamedTuple):
    """Requests a Pong, and reports the sender's measurements, so that the other side need not ping by itself.

    `uplink`: 0..255, the uplink it left by. `trip_us`: the round trip of the sender's ping answered last, 0 if none was
    answered since its last ping. `lost`: unanswered share of the sender's last pings, in units of 1/LOST_OF.
    `padding_bytes`: trailing zeros, to test a size.
    """

    sequence: int
    report: Report = Report()
    purpose: Purpose = Purpose.KEEPALIVE
    uplink: int = 0
    trip_us: int = 0
    lost: int = 0
    padding_bytes: int = 0


class Pong(NamedTuple):
    """The answer to a Ping, with its number. Shorter than the ping."""

    sequence: int
    report: Report = Report()


class Urgent(NamedTuple):
    """A message of the control channel that must not wait for a retransmission. JSON, as on the control channel.

    It is sent several times, and on the control channel too: the receiver counts it once.
    """

    text: bytes


Content = Frames | Ping | Pong | Urgent


def encode_urgent(text: bytes) -> bytes:
    """1 byte longer than the text. Raises ValueError if the text is empty or longer than MAX_URGENT_BYTES."""
    if not 0 < len(text) <= MAX_URGENT_BYTES:
        raise ValueError(f"an urgent message of {len(text)} bytes does not fit into a datagram")
    return bytes((_URGENT,)) + text


def encode_keepalive(content: Ping | Pong) -> bytes:
    """28 bytes plus padding for a ping, 21 for a pong."""
    if isinstance(content, Pong):
        return _PONG_FIXED.pack(_PONG, content.sequence, *content.report)
    sequence, report, purpose, uplink, trip_us, lost, padding_bytes = content
    return _PING_FIXED.pack(_PING, sequence, *report, purpose, uplink, trip_us, lost) + bytes(padding_bytes)


def encode_frames(
    drone_id: DroneId,
    epoch: Epoch,
    sent_ms: int,
    frames: Sequence[bytes],
    *,
    largest_bytes: int = MAX_CONTENT_BYTES,
    ping: Ping | None = None,
) -> list[bytes]:
    """Packs the frames in order into as few contents of at most `largest_bytes` as possible. Each frame (280 bytes at
    most) stays whole. `ping` goes into the first content; the caller has made sure that there is room for it."""
    header = _FRAMES_HEADER.pack(_FRAMES, drone_id, epoch, sent_ms)
    contents: list[bytes] = []
    parts = [header]
    size = len(header)
    if ping is not None:
        parts[0] = bytes((_PING_AND_FRAMES,)) + encode_keepalive(ping)[1:] + header
        size += PING_BYTES
    for frame in frames:
        if size + len(frame) > largest_bytes and len(parts) > 1:
            contents.append(b"".join(parts))
            parts = [header]
            size = len(header)
        parts.append(frame)
        size += len(frame)
    if len(parts) > 1:
        contents.append(b"".join(parts))
    return contents


def decode_content(content: bytes) -> Content:
    """Raises Dropped with BAD_CONTENT, or BAD_FRAME if the frames do not fill the content exactly."""
    kind = content[0] if content else 0
    if kind == _FRAMES:
        return _decode_frames(content, 0, None)
    if kind == _PING_AND_FRAMES and len(content) > PING_BYTES and content[PING_BYTES] == _FRAMES:
        ping = _decode_ping(content[:PING_BYTES])
        if ping.purpose is not Purpose.KEEPALIVE:
            raise Dropped(DropReason.BAD_CONTENT)
        return _decode_frames(content, PING_BYTES, ping)
    if kind == _PING and len(content) >= PING_BYTES:
        return _decode_ping(content)
    if kind == _PONG and len(content) == _PONG_FIXED.size:
        _, sequence, expected, received = _PONG_FIXED.unpack(content)
        return Pong(sequence, Report(expected, received))
    if kind == _URGENT and len(content) > 1:
        return Urgent(content[1:])
    raise Dropped(DropReason.BAD_CONTENT)


def _decode_frames(content: bytes, at: int, ping: Ping | None) -> Frames:
    begin = at + FRAMES_HEADER_BYTES
    if len(content) <= begin:
        raise Dropped(DropReason.BAD_CONTENT)
    _, drone_id, epoch, sent_ms = _FRAMES_HEADER.unpack_from(content, at)
    try:
        frames = split_frames(content, begin)
    except MalformedFrame:
        raise Dropped(DropReason.BAD_FRAME) from None
    return Frames(drone_id, epoch, sent_ms, frames, ping)


def _decode_ping(content: bytes) -> Ping:
    _, sequence, expected, received, purpose, uplink, trip_us, lost = _PING_FIXED.unpack_from(content)
    padding_bytes = len(content) - PING_BYTES
    if purpose >= len(_PURPOSES) or (padding_bytes and content.count(0, PING_BYTES) != padding_bytes):
        raise Dropped(DropReason.BAD_CONTENT)
    return Ping(sequence, Report(expected, received), _PURPOSES[purpose], uplink, trip_us, lost, padding_bytes)
