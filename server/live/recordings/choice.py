"""Which stream is recorded: one that runs already where it will do, because the drone encodes and sends each by itself.
Pure."""

from collections.abc import Collection
from typing import Final

from server.live.video.streams import StreamKey
from wire.video import Codec, Quality

USUAL: Final = Quality.MEDIUM


def choose(quality: Quality | None, *, wanted: Collection[StreamKey], codecs: Collection[Codec]) -> StreamKey:
    """`quality`: None for the best that is watched now. `codecs`: what the agent has; nothing: not known. H.264 before
    MPEG-1: it is kept as it comes."""
    running = [key for key in wanted if quality is None or key.quality is quality]
    if running:
        return max(running, key=lambda key: (key.quality, key.codec is Codec.H264))
    codec = Codec.H264 if Codec.H264 in codecs else Codec.MPEG1
    return StreamKey(USUAL if quality is None else quality, codec)
