"""The video of a drone as REST tells of it."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

from server.video.core.drone_video import DroneVideo, Flow
from server.video.core.situation import VideoCondition
from server.video.core.streams import StreamKey
from server.video.core.viewer_messages import CodecName, QualityName, codec_name, quality_name
from wire.video import Codec, Quality


class VideoStreamView(BaseModel):
    """A stream that is watched or recorded, or was until a moment ago."""

    quality: QualityName
    codec: CodecName
    state: VideoCondition
    words: Annotated[str, Field(description="For people: what is wrong; may be empty")]
    viewers: int
    recorded: bool
    width: Annotated[int, Field(description="Of the newest picture; 0: none received")]
    height: int
    rate_hz: Annotated[float, Field(description="Pictures a second")]
    bits_per_s: Annotated[int, Field(description="The encoder's present target")]


class VideoView(BaseModel):
    """The state of a drone's video."""

    state: Annotated[
        VideoCondition, Field(description="State of the best stream; without a stream, what a viewer would be told")
    ]
    words: str
    codecs: Annotated[list[CodecName], Field(description="Available codecs, as the agent reports")]
    clock_error_ms: Annotated[
        float | None, Field(description="Maximum error of the pictures' times; null: not known yet")
    ]
    streams: list[VideoStreamView]


def view_of(video: DroneVideo, now: float) -> VideoView:
    """`now`: monotonic seconds."""
    streams = [_stream(video, key, flow, now) for key, flow in sorted(video.flows.items())]
    newest = max(video.flows, default=StreamKey(Quality.MEDIUM, Codec.MPEG1))
    situation = video.situation(newest, now)
    error_ms = video.clock.error_ms(now)
    return VideoView(
        state=situation.condition,
        words=situation.words,
        codecs=[codec_name(codec) for codec in situation.codecs],
        clock_error_ms=None if error_ms is None else round(error_ms, 2),
        streams=streams,
    )


def _stream(video: DroneVideo, key: StreamKey, flow: Flow, now: float) -> VideoStreamView:
    situation = video.situation(key, now)
    return VideoStreamView(
        quality=quality_name(key.quality),
        codec=codec_name(key.codec),
        state=situation.condition,
        words=situation.words,
        viewers=sum(one.people for one in flow.viewers.values()),
        recorded=bool(flow.sinks),
        width=flow.size[0],
        height=flow.size[1],
        rate_hz=flow.rate_hz,
        bits_per_s=flow.bits_per_s,
    )
