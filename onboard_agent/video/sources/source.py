"""What every picture source is. The rest of the video process knows only this, and `camera.Camera` around it."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    import av

OPEN_PATIENCE_S: Final = 5.0
"""A camera that has given no picture by then is not there."""

NETWORK_LETS_GO_WITHIN_S: Final = OPEN_PATIENCE_S + 1.0
"""Only the system or FFmpeg can give up a connection attempt, when its patience ends."""

READ_PATIENCE_S: Final = 2.0
"""A camera that is silent for this long is reopened. Its silence is reported sooner (`camera_watch`)."""


class CameraLost(Exception):
    """There are no pictures (any more). The text is one line for people, and says what is wrong with which camera."""


class Picture(NamedTuple):
    """One uncompressed picture of the camera. `frame`: of any size and pixel format; read-only.

    `capture_us`: capture time by CLOCK_MONOTONIC, as near to the sensor as can be known. `number` counts the camera's
    pictures, from 1; a gap: pictures that were not fetched. `is_break`: the first one after the camera was opened
    (again).
    """

    frame: av.VideoFrame
    capture_us: int
    number: int
    is_break: bool


class Taken(NamedTuple):
    """What a source hands over: the picture, and when it was taken."""

    frame: av.VideoFrame
    capture_us: int


class PictureRequest(NamedTuple):
    """The largest size that is needed. A source with a choice takes the smallest picture that is at least as large."""

    width: int = 640
    height: int = 480
    rate_hz: float = 30.0


class Source(ABC):
    """A camera, or its substitute. Blocking; used by one thread, except for `close`.

    `open`, then `read` for ever, then `close`; after `close` it may be opened again.
    """

    lets_go_within_s = 0.5
    """After `interrupt`. What takes longer hangs in a driver."""

    def __init__(self, name: str) -> None:
        self.name = name
        """As the user wrote it, but without its password: for log lines and for people."""

    @abstractmethod
    def open(self, request: PictureRequest) -> None:
        """Raises CameraLost."""

    @abstractmethod
    def read(self) -> Taken | None:
        """Waits for the next picture, at most `READ_PATIENCE_S`. None: nothing yet, call again. Raises CameraLost when
        the camera is gone."""

    @abstractmethod
    def close(self) -> None:
        """Lets go of the camera. Safe when it is not open."""

    def interrupt(self) -> None:  # noqa: B027 - where it cannot be done, patience ends
        """Called by another thread: `read` must end soon; its result or exception does not matter."""


def now_us() -> int:
    """The clock of `capture_us`."""
    return time.monotonic_ns() // 1000
