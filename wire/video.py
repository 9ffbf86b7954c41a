"""Live video: the unit that travels from camera to screen, and the messages of tower and agent about it (no I/O).

A unit is one encoded picture with a fixed header, one binary WebSocket message: from the agent to the tower, and from
the tower to each viewer, identical but for the clock (docs/wire-protocol.md, 4).

MPEG-1 units carry whole MPEG-TS packets, H.264 units an access unit in Annex B with its parameter sets at each key
picture. Concatenated units of either codec form a file that any player opens.
"""

from enum import IntEnum, StrEnum
from struct import Struct
from typing import Annotated, Final, NamedTuple

import msgspec

VIDEO: Final = "video"
"""The entry in `takes` of hello and welcome for these messages."""

AGENT_VIDEO_SUBPROTOCOL: Final = "tower-agent-video.v1"
VIEWER_VIDEO_SUBPROTOCOL: Final = "tower-video.v1"

MAX_UNIT_BYTES: Final = 256 * 1024
"""Header and payload; a key picture of the highest quality is some 60 KiB."""

_VERSION: Final = 1
_HEADER: Final = Struct("<BBBBIQHHHHI")
HEADER_BYTES: Final = _HEADER.size
_CAPTURE_OFFSET: Final = 8
_CAPTURE: Final = Struct("<Q")

_KEY: Final = 1
_BREAK: Final = 2
_KNOWN_FLAGS: Final = _KEY | _BREAK


class Quality(IntEnum):
    """The quality that a viewer requests: limits for picture size, picture rate and bit rate."""

    LOW = 0
    MEDIUM = 1
    HIGH = 2


class QualityLimits(NamedTuple):
    """`width`, `height` in pixels: a picture of another shape is scaled to fit inside. `rate_hz`: pictures per second.
    Bits per second for MPEG-1."""

    width: int
    height: int
    rate_hz: float
    bits_per_s: int
    least_bits_per_s: int


LIMITS: Final = {
    Quality.LOW: QualityLimits(320, 240, 12.0, 200_000, 60_000),
    Quality.MEDIUM: QualityLimits(320, 240, 24.0, 450_000, 120_000),
    Quality.HIGH: QualityLimits(640, 480, 30.0, 1_500_000, 300_000),
}


class Codec(IntEnum):
    """How the pictures are encoded."""

    MPEG1 = 1
    H264 = 2


class MalformedUnit(ValueError):
    """The bytes are not a unit."""


class UnitHead(NamedTuple):
    """What is known of one encoded picture without decoding it.

    `sequence` counts the units of one stream (quality and codec) and wraps at 2**32; a gap is a loss. `key`: decoding
    can begin here. `is_break`: the preceding units do not lead up to this one (the camera was away). `capture_us`:
    capture time by the agent's monotonic clock on the way to the tower, by the tower's from there on; 0 while the tower
    does not know the clock offset. `rate_hz`: current picture rate. `bits_per_s`: the encoder's current target.
    `held_ms`: age of the picture when the agent handed it to the network, at most 65535.
    """

    quality: Quality
    codec: Codec
    sequence: int
    key: bool
    is_break: bool
    capture_us: int
    width: int
    height: int
    rate_hz: float
    bits_per_s: int
    held_ms: int


class Unit(NamedTuple):
    """One encoded picture: the fields of its head (UnitHead), and the picture."""

    quality: Quality
    codec: Codec
    sequence: int
    key: bool
    is_break: bool
    capture_us: int
    width: int
    height: int
    rate_hz: float
    bits_per_s: int
    held_ms: int
    payload: bytes


def encode_unit(unit: Unit) -> bytes:
    """Returns the message. Raises struct.error for a field out of its range."""
    flags = (_KEY if unit.key else 0) | (_BREAK if unit.is_break else 0)
    header = _HEADER.pack(
        _VERSION,
        flags,
        unit.quality,
        unit.codec,
        unit.sequence,
        unit.capture_us,
        unit.width,
        unit.height,
        round(unit.rate_hz * 100),
        unit.held_ms,
        unit.bits_per_s,
    )
    return header + unit.payload


def decode_unit(message: bytes) -> Unit:
    """Raises MalformedUnit."""
    return Unit(*decode_head(message), payload=message[HEADER_BYTES:])


def decode_head(message: bytes) -> UnitHead:
    """Returns the checked head of a whole message, without copying the picture. Raises MalformedUnit."""
    if not HEADER_BYTES < len(message) <= MAX_UNIT_BYTES:
        raise MalformedUnit(f"{len(message)} bytes are no unit")
    version, flags, quality, codec, sequence, capture_us, width, height, rate, held_ms, bits = _HEADER.unpack_from(
        message
    )
    if version != _VERSION or flags & ~_KNOWN_FLAGS:
        raise MalformedUnit(f"version {version}, flags {flags:#x}")
    if not (width and height and rate):
        raise MalformedUnit(f"a picture of {width} x {height} pixels at {rate / 100} Hz")
    try:
        named = Quality(quality), Codec(codec)
    except ValueError as error:
        raise MalformedUnit(str(error)) from None
    return UnitHead(
        *named,
        sequence=sequence,
        key=bool(flags & _KEY),
        is_break=bool(flags & _BREAK),
        capture_us=capture_us,
        width=width,
        height=height,
        rate_hz=rate / 100,
        bits_per_s=bits,
        held_ms=held_ms,
    )


def with_capture_time(message: bytes, capture_us: int) -> bytes:
    """Returns the same unit with a capture time by another clock."""
    return message[:_CAPTURE_OFFSET] + _CAPTURE.pack(capture_us) + message[_CAPTURE_OFFSET + _CAPTURE.size :]


_U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
_Words = Annotated[str, msgspec.Meta(max_length=200)]


class StreamRequest(msgspec.Struct, frozen=True):
    """One stream with viewers."""

    quality: Quality
    codec: Codec


class VideoWanted(msgspec.Struct, frozen=True, tag="video_wanted", tag_field="type", kw_only=True):
    """Tower to agent, at the beginning of a link and on each change: the streams now watched; empty: stop.

    `ticket` opens the video channel (`Authorization: Bearer`) of this link, and nothing else.
    """

    ticket: Annotated[str, msgspec.Meta(max_length=100)]
    streams: Annotated[tuple[StreamRequest, ...], msgspec.Meta(max_length=6)] = ()


class CameraState(StrEnum):
    """The agent's view of its camera."""

    NONE = "none"
    """No camera is configured."""
    IDLE = "idle"
    """Nobody watches: the camera is closed."""
    OPENING = "opening"
    LIVE = "live"
    LOST = "lost"
    """It cannot be opened, or delivers no pictures any more; the agent retries."""


class VideoState(msgspec.Struct, frozen=True, tag="video_state", tag_field="type", kw_only=True):
    """Agent to tower, at the beginning of a link and on each change.

    `words`: for people, what is wrong or holds the stream back; empty if nothing does. `thin`: the link carries less
    than the lowest bit rate of the streams watched. `codecs`: those that can be requested.
    """

    camera: CameraState
    words: _Words = ""
    thin: bool = False
    codecs: Annotated[tuple[Codec, ...], msgspec.Meta(max_length=4)] = (Codec.MPEG1,)


class ClockProbe(msgspec.Struct, frozen=True, tag="clock_probe", tag_field="type", kw_only=True):
    """Tower to agent, on the data channel if there is one, while video is watched: requests the agent's time."""

    number: _U32


class ClockAnswer(msgspec.Struct, frozen=True, tag="clock_answer", tag_field="type", kw_only=True):
    """Agent to tower, at once and on the same channel. `at_us`: the agent's monotonic clock."""

    number: _U32
    at_us: Annotated[int, msgspec.Meta(ge=0)]


class KeyWanted(msgspec.Struct, frozen=True, tag="key", tag_field="type"):
    """Tower to agent, text on the video channel: requests a key picture of this stream."""

    quality: Quality
    codec: Codec


VideoToAgent = VideoWanted | ClockProbe
VideoToTower = VideoState | ClockAnswer

_GOT: Final = Struct("<BBI")


class Got(NamedTuple):
    """Tower to agent on the video channel, binary, for each unit: it has arrived whole. The agent uses it to measure
    what the link carries."""

    quality: Quality
    codec: Codec
    sequence: int


def encode_got(got: Got) -> bytes:
    """Six bytes."""
    return _GOT.pack(*got)


def decode_got(message: bytes) -> Got:
    """Raises MalformedUnit."""
    if len(message) != _GOT.size:
        raise MalformedUnit(f"{len(message)} bytes say nothing of a unit")
    quality, codec, sequence = _GOT.unpack(message)
    try:
        return Got(Quality(quality), Codec(codec), sequence)
    except ValueError as error:
        raise MalformedUnit(str(error)) from None
