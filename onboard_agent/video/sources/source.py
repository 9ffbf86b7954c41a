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
"""A connection that is being made can be given up by nobody but the system or FFmpeg, when patience ends."""

READ_PATIENCE_S: Final = 2.0
"""A camera that says nothing for so long is opened again. That it is silent is said sooner (`camera_watch`)."""


class CameraLost(Exception):
    """There are no pictures (any more). The text is one line for a person, and says what is wrong with which camera."""


class Picture(NamedTuple):
    """One picture as the camera gave it, uncompressed.

    `frame`: of any size and pixel format; nobody may write into it. `capture_us`: when it was taken, by
    CLOCK_MONOTONIC, as near to the sensor as can be known. `number` counts what the camera gave, from 1; a gap: nobody
    came for those between. `is_break`: the first one after the camera was opened (again).
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
    """The most that anybody needs. A source that can choose gives the smallest picture that is at least as large."""

    width: int = 640
    height: int = 480
    rate_hz: float = 30.0


class Source(ABC):
    """A camera, or what stands for one. Blocking; used by one thread, but for `close`.

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
        """Waits for the next picture, at most `READ_PATIENCE_S`. None: nothing yet, ask again. Raises CameraLost when
        the camera is gone."""

    @abstractmethod
    def close(self) -> None:
        """Lets go of the camera. Safe when it is not open."""

    def interrupt(self) -> None:  # noqa: B027 - where it cannot be done, patience ends
        """Another thread wants `read` to end soon; what it then gives or raises does not matter."""


def now_us() -> int:
    """The clock of `capture_us`."""
    return time.monotonic_ns() // 1000
