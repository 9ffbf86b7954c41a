"""The text messages between a viewer of video and the tower (docs/wire-protocol.md, 4.3)."""

from typing import Annotated, Final, Literal

import msgspec

from server.video.core.situation import VideoSituation
from server.video.core.streams import StreamKey
from wire.control_messages import UNREADABLE
from wire.video import Codec, Quality

MAX_REQUEST_BYTES: Final = 1024

QualityName = Literal["low", "medium", "high"]
CodecName = Literal["mpeg1", "h264"]


class MalformedVideoRequest(ValueError):
    """A viewer sent an invalid message. The text says what is wrong with it."""


class AskClock(msgspec.Struct, frozen=True, tag="clock", tag_field="type"):
    """What time is it with you? `sent` comes back as it is."""

    sent: Annotated[float, msgspec.Meta(ge=-1e15, le=1e15)]


class Drawn(msgspec.Struct, frozen=True, tag="got", tag_field="type"):
    """The newest unit drawn; all before it are done too.

    `calm`: nothing was late for a while; the viewer repeats this every two seconds and reports as soon as something is
    late. `overdue`: the next unit should have arrived. `held_ms`: time between drawing and this report.
    """

    sequence: Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
    calm: bool = False
    overdue: bool = False
    held_ms: Annotated[float, msgspec.Meta(ge=0, le=10_000)] = 0.0


class ChangeStream(msgspec.Struct, frozen=True, tag="want", tag_field="type"):
    """Another stream, from now on."""

    quality: QualityName
    codec: CodecName


class StateMessage(msgspec.Struct, frozen=True, tag="state", tag_field="type"):
    """How it is with the video, at the beginning and on each change."""

    state: str
    words: str
    codecs: list[str]
    quality: str
    codec: str


class ClockMessage(msgspec.Struct, frozen=True, tag="clock", tag_field="type"):
    """The answer. `tower_us`: the tower's monotonic clock."""

    sent: float
    tower_us: int


class SkippedMessage(msgspec.Struct, frozen=True, tag="skipped", tag_field="type"):
    """So many units more were not sent: this viewer was too slow for them."""

    count: int


VideoRequest = AskClock | Drawn | ChangeStream
ToViewer = StateMessage | ClockMessage | SkippedMessage

_decoder: Final[msgspec.json.Decoder[VideoRequest]] = msgspec.json.Decoder(VideoRequest)
_encoder: Final = msgspec.json.Encoder()


def decode_video_request(text: bytes) -> VideoRequest:
    """Raises MalformedVideoRequest."""
    try:
        return _decoder.decode(text)
    except UNREADABLE as error:
        raise MalformedVideoRequest(str(error)) from None


def encode_to_viewer(message: ToViewer) -> bytes:
    """UTF-8."""
    return _encoder.encode(message)


def state_message(situation: VideoSituation, key: StreamKey) -> StateMessage:
    """The state for the viewer of one stream."""
    return StateMessage(
        state=situation.condition.value,
        words=situation.words,
        codecs=[codec_name(codec) for codec in situation.codecs],
        quality=quality_name(key.quality),
        codec=codec_name(key.codec),
    )


_QUALITY_NAMES: Final[dict[Quality, QualityName]] = {
    Quality.LOW: "low",
    Quality.MEDIUM: "medium",
    Quality.HIGH: "high",
}
_CODEC_NAMES: Final[dict[Codec, CodecName]] = {Codec.MPEG1: "mpeg1", Codec.H264: "h264"}


def quality_name(quality: Quality) -> QualityName:
    """As addresses and JSON have it."""
    return _QUALITY_NAMES[quality]


def codec_name(codec: Codec) -> CodecName:
    """As addresses and JSON have it."""
    return _CODEC_NAMES[codec]


def stream_named(quality: str, codec: str) -> StreamKey:
    """The stream of these names. Raises MalformedVideoRequest."""
    named_quality = next((one for one, name in _QUALITY_NAMES.items() if name == quality), None)
    named_codec = next((one for one, name in _CODEC_NAMES.items() if name == codec), None)
    if named_quality is None:
        raise MalformedVideoRequest(f"quality must be one of {', '.join(_QUALITY_NAMES.values())}")
    if named_codec is None:
        raise MalformedVideoRequest(f"codec must be one of {', '.join(_CODEC_NAMES.values())}")
    return StreamKey(named_quality, named_codec)


def streams_named(quality: str, codecs: str) -> list[StreamKey]:
    """The streams of a quality and of codecs with commas between, at most as many as there are. Raises
    MalformedVideoRequest."""
    names = codecs.split(",")
    if len(names) > len(_CODEC_NAMES):
        raise MalformedVideoRequest(f"codec must be at most {len(_CODEC_NAMES)} names, with commas between")
    return [stream_named(quality, name) for name in names]
