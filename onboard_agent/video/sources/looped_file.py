"""Plays a video file in a loop, at its own rate: for trials, and for drones whose camera writes a file."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import av
from av.container import InputContainer

from onboard_agent.video.sources.decoding import SIZE_BOUND, check_stream, hold_nothing, lost, lost_while_decoding
from onboard_agent.video.sources.source import CameraLost, PictureRequest, Source, Taken, now_us

_RATE_HZ: Final = 25.0
"""For a file that does not state its rate."""
_MAX_WAIT_S: Final = 0.2
_TOO_LATE_US: Final = 500_000
"""If it is this far behind its own rate, it continues from now instead of catching up."""


class LoopedFile(Source):
    """Gives each picture at the moment at which it is due."""

    def __init__(self, name: str, path: Path) -> None:
        super().__init__(name)
        self._path = path
        self._container: InputContainer | None = None
        self._frames: Iterator[tuple[av.VideoFrame, int]] = iter(())
        self._next: tuple[av.VideoFrame, int] | None = None
        self._began_us = 0

    def open(self, request: PictureRequest) -> None:
        try:
            self._container = av.open(str(self._path), options=SIZE_BOUND)
        except (av.FFmpegError, OSError, ValueError) as error:
            raise lost(self.name, error) from error
        check_stream(self.name, self._container)
        self._frames = self._for_ever(self._container)
        self._began_us = now_us()

    def read(self) -> Taken | None:
        try:
            if self._next is None:
                self._next = next(self._frames, None)
        except (av.FFmpegError, OSError) as error:
            raise lost_while_decoding(self.name, error) from error
        if self._next is None:
            raise CameraLost(f"{self.name}: has no pictures")
        frame, at_us = self._next
        wait_us = self._began_us + at_us - now_us()
        if wait_us > 0:
            time.sleep(min(wait_us / 1e6, _MAX_WAIT_S))
            if wait_us > _MAX_WAIT_S * 1e6:
                return None
        elif wait_us < -_TOO_LATE_US:
            self._began_us -= wait_us
        self._next = None
        return Taken(frame, self._began_us + at_us)

    def close(self) -> None:
        self._frames = iter(())
        self._next = None
        if self._container is not None:
            self._container.close()
            self._container = None

    @staticmethod
    def _for_ever(container: InputContainer) -> Iterator[tuple[av.VideoFrame, int]]:
        """Yields each picture and when it is due after the start, in microseconds. Ends if the file has no pictures."""
        stream = container.streams.video[0]
        hold_nothing(stream.codec_context)
        assert stream.time_base is not None
        step_us = int(1e6 / float(stream.average_rate or _RATE_HZ))
        due_us = -step_us
        while True:
            begin_us, first_us = due_us + step_us, None
            for frame in container.decode(stream):
                before_us, due_us = due_us, due_us + step_us
                if frame.pts is not None:
                    at_us = int(frame.pts * stream.time_base * 1_000_000)
                    first_us = at_us if first_us is None else first_us
                    due_us = max(before_us, begin_us + at_us - first_us)
                    if at_us > first_us:  # the last picture is shown for as long as its predecessor
                        step_us = due_us - before_us
                yield frame, due_us
            if due_us < begin_us:
                return
            container.seek(0)
