"""Burns the flight display into a recording: each picture again, at its time, as MP4 with H.264. Blocking and heavy;
runs in the process of `make_display_video`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final, NamedTuple

import av
import numpy as np
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from server.flights.core.videos.display_values import DisplayTimeline
from server.flights.store.videos.drawing import Display

_MP4: Final = {"movflags": "+faststart"}
_X264: Final = {"preset": "veryfast", "crf": "23", "x264-params": "scenecut=0"}
_KEY_EVERY: Final = 60
MAX_PIXELS: Final = 1920 * 1080
"""A recording of the tower has no more."""

OnProgress = Callable[[int], None]
"""Called with the number of finished pictures."""


class NoVideo(ValueError):
    """The file has no pictures, or too large ones."""


class Burnt(NamedTuple):
    pictures: int
    size_bytes: int


def burn(source: Path, target: Path, began_us: int, timeline: DisplayTimeline, on_progress: OnProgress) -> Burnt:
    """Writes `target`. `began_us`: when the first picture was taken, in microseconds since 1970. Raises NoVideo,
    OSError, av.error.FFmpegError."""
    pictures = 0
    with av.open(str(source)) as film, av.open(str(target), "w", format="mp4", options=_MP4) as output:
        found = film.streams.video[0] if film.streams.video else None
        if found is None or found.time_base is None or not 0 < found.width * found.height <= MAX_PIXELS:
            raise NoVideo("the recording has no pictures that can be drawn on")
        found.thread_count = 1  # flights need the other processors
        time_base = found.time_base
        stream: VideoStream = output.add_stream("libx264", rate=30, options=_X264)
        stream.width, stream.height, stream.pix_fmt = found.width, found.height, "yuv420p"
        context = stream.codec_context
        context.time_base, context.gop_size, context.max_b_frames, context.thread_count = time_base, _KEY_EVERY, 0, 1
        lasts: dict[int, int] = {}

        def put(packets: list[av.Packet[VideoStream]]) -> None:
            for packet in packets:
                packet.duration = lasts.pop(packet.pts or 0, 0)
                output.mux_one(packet)

        display = Display(found.width, found.height)
        for frame in film.decode(found):
            at = frame.pts or 0
            values = timeline.at(began_us + round(at * time_base * 1_000_000))
            picture = np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)
            drawn = VideoFrame.from_ndarray(display.draw(picture, values), format="rgb24")
            ready = drawn.reformat(width=found.width, height=found.height, format="yuv420p")
            ready.pts, ready.time_base = at, time_base
            lasts[at] = frame.duration
            put(stream.encode(ready))
            pictures += 1
            on_progress(pictures)
        if not pictures:
            raise NoVideo("the recording has no pictures")
        put(stream.encode(None))
    return Burnt(pictures, target.stat().st_size)
