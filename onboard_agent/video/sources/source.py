"""The interface of every picture source. The video process uses only this, and `camera.Camera` around it."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    import av

OPEN_PATIENCE_S: Final = 5.0
"""A camera without a picture by then is considered absent."""

NETWORK_LETS_GO_WITHIN_S: Final = OPEN_PATIENCE_S + 1.0
"""A connection attempt ends only by the timeout of the system or of FFmpeg."""

READ_PATIENCE_S: Final = 2.0
"""A camera silent for this long is reopened. The silence is reported sooner (`camera_watch`)."""


class CameraLost(Exception):
    """There are no (more) pictures. The text is one line for users, and names the camera and the problem."""


class Picture(NamedTuple):
    """One uncompressed picture from the camera.

    `frame`: of any size and pixel format; must not be modified. `capture_us`: when it was taken, by CLOCK_MONOTONIC, as
    close to the sensor as possible. `number` counts the camera's pictures from 1; a gap means that pictures in between
    were not fetched. `is_break`: the first picture after the camera was opened (again).
    """

    frame: av.VideoFrame
    capture_us: int
    number: int
    is_break: bool


class Taken(NamedTuple):
    """Result of a source: the picture, and when it was taken."""

    frame: av.VideoFrame
    capture_us: int


class PictureRequest(NamedTuple):
    """The maximum needed. A source with a choice gives the smallest picture that is at least as large."""

    width: int = 640
    height: int = 480
    rate_hz: float = 30.0


class Source(ABC):
    """A camera, or a substitute for one. Blocking; used by one thread, except `interrupt`.

    Call `open`, then `read` repeatedly, then `close`; after `close` it may be opened again.
    """

    lets_go_within_s = 0.5
    """After `interrupt`. A source that takes longer hangs in a driver."""

    def __init__(self, name: str) -> None:
        self.name = name
        """As the user wrote it, but without the password: for logs and users."""

    @abstractmethod
    def open(self, request: PictureRequest) -> None:
        """Raises CameraLost."""

    @abstractmethod
    def read(self) -> Taken | None:
        """Waits for the next picture, at most `READ_PATIENCE_S`. None: no picture yet, call again. Raises CameraLost if
        the camera is gone."""

    @abstractmethod
    def close(self) -> None:
        """Releases the camera. Does nothing if it is not open."""

    def interrupt(self) -> None:  # noqa: B027 - where it cannot be done, patience ends
        """Called by another thread to end `read` soon; its result or exception is then irrelevant."""


def now_us() -> int:
    """The clock of `capture_us`."""
    return time.monotonic_ns() // 1000
