"""What state the camera is in, by what it gave and when (no I/O)."""

from typing import Final

from wire.video import CameraState

SILENT_S: Final = 0.6
"""A working camera without a picture for this long is lost: the screen must show that within a second."""

_SILENT_PICTURES: Final = 4.0
"""A slow camera may be silent for this many of its own intervals."""
_MAX_INTERVAL_S: Final = 0.5
_SMOOTHING: Final = 0.2


class CameraWatch:
    """Takes the events and derives the camera's state."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._last_at: float | None = None
        self._interval_s = 0.0
        self.state = CameraState.IDLE
        self.words = ""

    def opening(self) -> None:
        """It is being opened. After a loss that stays a loss until there is a picture."""
        self._last_at = None
        if self.state is not CameraState.LOST:
            self.state, self.words = CameraState.OPENING, ""

    def picture(self, now: float) -> None:
        """It gave one."""
        if self._last_at is not None:
            interval_s = min(now - self._last_at, _MAX_INTERVAL_S)
            self._interval_s += _SMOOTHING * (interval_s - self._interval_s)
        self._last_at = now
        self.state, self.words = CameraState.LIVE, ""

    def lost(self, words: str) -> None:
        """It cannot be opened, or is gone."""
        self._last_at = None
        self.state, self.words = CameraState.LOST, words

    def closed(self) -> None:
        """Its pictures are not wanted."""
        self._last_at = None
        self.state, self.words = CameraState.IDLE, ""

    @property
    def may_be_silent_s(self) -> float:
        """How long it may give nothing before it counts as lost."""
        return max(SILENT_S, _SILENT_PICTURES * self._interval_s)

    def tick(self, now: float) -> None:
        """Time has passed."""
        if self.state is CameraState.LIVE and self._last_at is not None and now - self._last_at > self.may_be_silent_s:
            self.state, self.words = CameraState.LOST, f"{self._name}: gives no pictures any more"
