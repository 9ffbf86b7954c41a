"""What towers tell each other of video, on a connection of its own to the bus. No I/O.

Each packet has one message and stands alone: units have numbers, and what is asked for is asked for again every second.
Packets are sealed, as all others on the bus (server.towers.core.messages).
"""

from struct import Struct
from typing import Annotated, Final, NamedTuple

import msgspec

from server.towers.core.messages import MalformedPacket
from server.video.core.situation import VideoCondition, VideoSituation
from server.video.core.streams import StreamKey
from wire.lateness import stamp_ms
from wire.video import Codec, Quality

MAX_STREAMS: Final = len(Quality) * len(Codec)
_HEADER: Final = Struct("<16sI")


class WantedStream(msgspec.Struct, frozen=True, array_like=True):
    """One stream of a drone, and how many people of the sender see it."""

    quality: Quality
    codec: Codec
    people: Annotated[int, msgspec.Meta(ge=0)]

    @property
    def key(self) -> StreamKey:
        return StreamKey(self.quality, self.codec)


class WantVideo(msgspec.Struct, frozen=True, array_like=True, tag=0):
    """Every second, and at once when it changes: the streams that people of the sender see now. Empty: none any more.
    `probe`: asks for the receiver's clock; 0: does not."""

    drone_id: int
    streams: Annotated[list[WantedStream], msgspec.Meta(max_length=MAX_STREAMS)]
    probe: int = 0


class Arrived(msgspec.Struct, frozen=True, array_like=True):
    """The newest unit of a stream that has arrived, `held_ms` ago; all before it have, or never will."""

    drone_id: int
    quality: Quality
    codec: Codec
    sequence: int
    held_ms: float


class UnitsArrived(msgspec.Struct, frozen=True, array_like=True, tag=1):
    """Some hundredths of a second's units, of all drones together."""

    units: list[Arrived]


class WantKey(msgspec.Struct, frozen=True, array_like=True, tag=2):
    """A unit is missing: the newest group is to be sent from its beginning."""

    drone_id: int
    quality: Quality
    codec: Codec


class UnitSent(msgspec.Struct, frozen=True, array_like=True, tag=3):
    """One unit, as in wire.video, its `capture_us` by the sender's clock."""

    drone_id: int
    unit: bytes


class StreamTold(msgspec.Struct, frozen=True, array_like=True):
    """How it is with one stream."""

    quality: Quality
    codec: Codec
    condition: VideoCondition
    words: str
    codecs: list[Codec]

    @property
    def situation(self) -> VideoSituation:
        return VideoSituation(self.condition, self.words, tuple(self.codecs))


class VideoTold(msgspec.Struct, frozen=True, array_like=True, tag=4):
    """The answer to each WantVideo, and on each change. `barred`: a user who may not watch, though it is their drone;
    0: nobody. `probe` and `at_us`: the sender's monotonic clock, if it was asked for."""

    drone_id: int
    barred: int
    streams: list[StreamTold]
    probe: int = 0
    at_us: int = 0


VideoMessage = WantVideo | UnitsArrived | WantKey | UnitSent | VideoTold


class VideoPacket(NamedTuple):
    """Sender, its clock, and what it says. `sent_ms`: as in wire.lateness."""

    sender: str
    sent_ms: int
    body: bytes


_encoder: Final = msgspec.msgpack.Encoder()
_decoder: Final[msgspec.msgpack.Decoder[VideoMessage]] = msgspec.msgpack.Decoder(VideoMessage)


def encode_video(sender: str, message: VideoMessage, now: float) -> bytes:
    """`sender`: a tower's number, 32 hexadecimal digits."""
    return _HEADER.pack(bytes.fromhex(sender), stamp_ms(now)) + _encoder.encode(message)


def read_video_header(packet: bytes) -> VideoPacket:
    """Reads the header; the body stays as it is. Raises MalformedPacket."""
    if len(packet) < _HEADER.size:
        raise MalformedPacket("too short")
    sender, sent_ms = _HEADER.unpack_from(packet)
    return VideoPacket(sender.hex(), sent_ms, packet[_HEADER.size :])


def decode_video(body: bytes) -> VideoMessage:
    """Raises MalformedPacket."""
    try:
        return _decoder.decode(body)
    except (msgspec.MsgspecError, ValueError) as error:
        raise MalformedPacket(str(error)) from None
