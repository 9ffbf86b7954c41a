"""The newest picture of the video process in shared memory, for a controller: no camera is opened a second time.

One writer, any number of readers, no lock and no queue. The sequence is odd while a picture is being written; a reader
that sees it change meanwhile reads again. The flight process makes the memory, and both sides open it by its path.
"""

from __future__ import annotations

import mmap
import os
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Final

import av
import numpy as np

from onboard_agent.video.core.frame_memory import HEADER_BYTES, MAX_HEIGHT_PX, MAX_WIDTH_PX, SIZE_BYTES
from onboard_agent.video.sources.source import Picture

if TYPE_CHECKING:
    import numpy.typing as npt

_SEQUENCE: Final = struct.Struct("<Q")
_HEAD: Final = struct.Struct("<QQII?")
"""Capture time in microseconds, number, width, height, whether it is the first after a break."""
_TRIES: Final = 3


def _mapped(path: str, *, writes: bool) -> mmap.mmap:
    """Raises OSError, and ValueError for a file that is too short."""
    fd = os.open(Path(path), os.O_RDWR if writes else os.O_RDONLY)
    try:
        return mmap.mmap(fd, SIZE_BYTES, access=mmap.ACCESS_WRITE if writes else mmap.ACCESS_READ)
    finally:
        os.close(fd)


class FrameWriter:
    """In the video process. Raises OSError and ValueError where the memory cannot be opened."""

    def __init__(self, path: str) -> None:
        self._memory = _mapped(path, writes=True)
        (self._sequence,) = _SEQUENCE.unpack_from(self._memory)
        self._sequence += self._sequence % 2

    def write(self, picture: Picture) -> None:
        """Takes a picture of any size and format; a larger one is made smaller."""
        frame = picture.frame
        shrink = min(MAX_WIDTH_PX / frame.width, MAX_HEIGHT_PX / frame.height, 1.0)
        width, height = max(int(frame.width * shrink), 1), max(int(frame.height * shrink), 1)
        pixels = np.ascontiguousarray(frame.to_ndarray(format="bgr24", width=width, height=height))
        _SEQUENCE.pack_into(self._memory, 0, self._sequence + 1)
        _HEAD.pack_into(
            self._memory, _SEQUENCE.size, picture.capture_us, picture.number, width, height, picture.is_break
        )
        self._memory[HEADER_BYTES : HEADER_BYTES + pixels.nbytes] = pixels.tobytes()
        self._sequence += 2
        _SEQUENCE.pack_into(self._memory, 0, self._sequence)


class FrameReader:
    """In any other process of the same user. Raises OSError and ValueError where the memory cannot be opened."""

    def __init__(self, path: str) -> None:
        self._memory = _mapped(path, writes=False)
        self._read = self._now()
        """What was written before it looked is old."""

    def _now(self) -> int:
        sequence: int = _SEQUENCE.unpack_from(self._memory)[0]
        return sequence

    def has_news(self) -> bool:
        """Whether there is a picture that was not read yet."""
        return self._now() != self._read

    def newest(self) -> Picture | None:
        """Returns the newest picture once. None: nothing new."""
        for _ in range(_TRIES):
            before = self._now()
            if before == self._read:
                return None
            if before % 2:
                continue
            capture_us, number, width, height, is_break = _HEAD.unpack_from(self._memory, _SEQUENCE.size)
            if not (0 < width <= MAX_WIDTH_PX and 0 < height <= MAX_HEIGHT_PX):
                continue
            data = self._memory[HEADER_BYTES : HEADER_BYTES + 3 * width * height]
            if self._now() == before:
                self._read = before
                pixels: npt.NDArray[np.uint8] = np.frombuffer(data, np.uint8).reshape(height, width, 3)
                return Picture(av.VideoFrame.from_ndarray(pixels, format="bgr24"), capture_us, number, is_break)
        return None
