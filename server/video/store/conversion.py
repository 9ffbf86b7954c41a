"""Converts the units of a recording to an MP4 that plays everywhere: H.264, yuv420p, its index in front.

H.264 with a single set of parameters is repackaged picture by picture. Everything else is decoded and encoded again:
MPEG-1, which browsers and phones do not play from a file, and H.264 whose size changed in between. Blocking and heavy;
runs in the process of `make_mp4`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from io import BytesIO
from pathlib import Path
from typing import IO, Final, NamedTuple

import av
from av.codec.context import Flags
from av.filter import Graph
from av.video.codeccontext import VideoCodecContext
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from server.video.core.recordings.units import (
    TICKS_PER_S,
    NoRecording,
    Shown,
    Taken,
    first_lag_us,
    parameter_sets,
    read_entries,
    shown_times,
)
from wire.transport_stream import MalformedPackets, pictures_in, video_in
from wire.video import Codec, Unit

MAX_WIDTH: Final = 1920
MAX_HEIGHT: Final = 1080
"""Larger pictures are scaled down: no agent sends them, and each would take a second to encode."""
_TIME_BASE: Final = Fraction(1, TICKS_PER_S)
_MP4: Final = {"movflags": "+faststart"}
_X264: Final = {"preset": "veryfast", "crf": "23", "x264-params": "scenecut=0"}
_KEY_EVERY: Final = 60

OnProgress = Callable[[int], None]
"""Called with the number of finished pictures."""


class Survey(NamedTuple):
    """The content of a recording. `width`, `height`: of the largest picture. `uniform`: one size and one set of
    parameters throughout. `first_key`: the first unit from which it can be decoded."""

    codec: Codec
    width: int
    height: int
    uniform: bool
    taken: list[Taken]
    first_key: Unit


class Made(NamedTuple):
    """`pictures`: those in the file, without damaged ones. `first_lag_s`: by how much the file begins before its first
    picture came, if the time of capture is not known; otherwise 0."""

    duration_s: float
    width: int
    height: int
    pictures: int
    recoded: bool
    first_lag_s: float


def survey(file: IO[bytes], on_progress: OnProgress) -> Survey:
    """Raises NoRecording if there is no picture to begin with."""
    first: Unit | None = None
    sets: tuple[bytes, ...] = ()
    uniform = True
    size = (0, 0)
    taken: list[Taken] = []
    for came_us, unit in read_entries(file):
        if first is None:
            if not unit.key:
                continue
            first, sets = unit, parameter_sets(unit.payload)
        on_progress(0)
        taken.append(Taken(unit.capture_us, came_us, unit.rate_hz))
        size = max(size, (unit.width, unit.height), key=lambda one: one[0] * one[1])
        uniform = uniform and (unit.width, unit.height) == (first.width, first.height)
        if unit.key and unit.codec is Codec.H264:
            uniform = uniform and parameter_sets(unit.payload) == sets
    if first is None:
        raise NoRecording("no picture came")
    return Survey(first.codec, *size, uniform, taken, first)


def make(file: IO[bytes], found: Survey, target: Path, on_progress: OnProgress) -> Made:
    """Writes `target`. Raises NoRecording, OSError, av.error.FFmpegError."""
    units = _units_from_key(file)
    shown = shown_times(found.taken)
    if found.codec is Codec.H264 and found.uniform:
        return _pack(units, found, shown, target, on_progress)
    return _code_again(units, found, shown, target, on_progress)


def _units_from_key(file: IO[bytes]) -> Iterator[Unit]:
    begun = False
    for entry in read_entries(file):
        begun = begun or entry.unit.key
        if begun:
            yield entry.unit


def _pack(units: Iterator[Unit], found: Survey, shown: list[Shown], target: Path, on_progress: OnProgress) -> Made:
    with (
        av.open(BytesIO(found.first_key.payload), format="h264") as sample,
        av.open(str(target), "w", format="mp4", options=_MP4) as output,
    ):
        template = sample.streams.video[0]
        stream = output.add_stream_from_template(template)
        stream.time_base = _TIME_BASE
        done = 0
        for unit, (at, lasts) in zip(units, shown, strict=True):
            packet = av.Packet(unit.payload)
            packet.stream = stream
            packet.time_base = _TIME_BASE
            packet.pts = packet.dts = at
            packet.duration = lasts
            packet.is_keyframe = unit.key
            output.mux_one(packet)
            done += 1
            on_progress(done)
        width, height = template.codec_context.width, template.codec_context.height
    return Made(_seconds(shown), width, height, done, recoded=False, first_lag_s=_first_lag_s(found))


def _code_again(
    units: Iterator[Unit], found: Survey, shown: list[Shown], target: Path, on_progress: OnProgress
) -> Made:
    width, height = _file_size(found.width, found.height)
    fitting = Fitting(width, height)
    decoder = _Decoder(found.codec)
    with av.open(str(target), "w", format="mp4", options=_MP4) as output:
        stream: VideoStream = output.add_stream("libx264", rate=30, options=_X264)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        context = stream.codec_context
        context.time_base, context.gop_size, context.max_b_frames = _TIME_BASE, _KEY_EVERY, 0
        context.thread_count = 1  # flights need the other processors
        lasts_by_time: dict[int, int] = {}
        pictures = 0
        last: VideoFrame | None = None

        def put(packets: list[av.Packet[VideoStream]]) -> None:
            for packet in packets:
                packet.duration = lasts_by_time.pop(packet.pts or 0, 0)
                output.mux_one(packet)

        for number, (unit, (at, lasts)) in enumerate(zip(units, shown, strict=True)):
            frame = decoder.decode(unit)
            if frame is not None:
                last = fitting.fit(frame)
            elif last is None:
                continue
            # For a picture that cannot be decoded the previous one stays, so that the times stay right.
            last.pts, last.time_base = at, _TIME_BASE
            last.pict_type = 0
            lasts_by_time[at] = lasts
            put(stream.encode(last))
            pictures += frame is not None
            on_progress(number)
        if last is None:
            raise NoRecording("no picture could be decoded")
        put(stream.encode(None))
    return Made(_seconds(shown), width, height, pictures, recoded=True, first_lag_s=_first_lag_s(found))


class _Decoder:
    """Returns one picture for each unit, without waiting for the next."""

    def __init__(self, codec: Codec) -> None:
        self._codec = codec
        self._context: VideoCodecContext = VideoCodecContext.create(
            "mpeg1video" if codec is Codec.MPEG1 else "h264", "r"
        )
        self._context.thread_count = 1
        self._context.flags |= Flags.low_delay

    def decode(self, unit: Unit) -> VideoFrame | None:
        """None if it cannot be decoded."""
        try:
            if self._codec is Codec.H264:
                return next(iter(self._context.decode(av.Packet(unit.payload))), None)
            found: VideoFrame | None = None
            for picture in pictures_in(video_in(unit.payload)):
                for frame in self._context.decode(av.Packet(picture)):
                    found = found or frame
            return found
        except (av.error.FFmpegError, MalformedPackets):
            return None


def _file_size(width: int, height: int) -> tuple[int, int]:
    shrink = min(1.0, MAX_WIDTH / width, MAX_HEIGHT / height)
    return max(2, int(width * shrink) // 2 * 2), max(2, int(height * shrink) // 2 * 2)


def _seconds(shown: list[Shown]) -> float:
    return (shown[-1].at + shown[-1].lasts) / TICKS_PER_S


def _first_lag_s(found: Survey) -> float:
    return first_lag_us(found.taken) / 1_000_000


_MAX_GRAPHS: Final = 8


class Fitting:
    """`width`, `height`: of the file, even numbers."""

    def __init__(self, width: int, height: int) -> None:
        self._size = (width, height)
        self._graphs: dict[tuple[int, int, str], Graph] = {}

    def fit(self, frame: VideoFrame) -> VideoFrame:
        """Returns the picture in yuv420p and in the size of the file."""
        if (frame.width, frame.height) == self._size and frame.format.name == "yuv420p":
            return frame
        key = (frame.width, frame.height, frame.format.name)
        graph = self._graphs.get(key)
        if graph is None:
            if len(self._graphs) >= _MAX_GRAPHS:
                self._graphs.clear()
            graph = self._graphs[key] = self._new_graph(frame)
        graph.push(frame)
        fitted = graph.pull()
        assert isinstance(fitted, VideoFrame)
        return fitted

    def _new_graph(self, frame: VideoFrame) -> Graph:
        width, height = self._size
        graph = Graph()
        last = graph.add_buffer(width=frame.width, height=frame.height, format=frame.format, time_base=frame.time_base)
        for name, settings in (
            ("scale", f"{width}:{height}:force_original_aspect_ratio=decrease:force_divisible_by=2"),
            ("pad", f"{width}:{height}:(ow-iw)/2:(oh-ih)/2"),
            ("setsar", "1"),
            ("format", "yuv420p"),
            ("buffersink", ""),
        ):
            node = graph.add(name, settings) if settings else graph.add(name)
            last.link_to(node)
            last = node
        graph.configure()
        return graph
