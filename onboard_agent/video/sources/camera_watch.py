"""Derives the state of the camera from its pictures and their times (no I/O)."""

from typing import Final

from wire.video import CameraState

SILENT_S: Final = 0.6
"""A live camera without pictures for this long counts as lost, so that the screen shows it within a second."""

_SILENT_PICTURES: Final = 4.0
"""A slow camera may be silent for this many of its own intervals."""
_MAX_INTERVAL_S: Final = 0.5
_SMOOTHING: Final = 0.2


class CameraWatch:
    """Takes events, and provides the resulting state."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._last_at: float | None = None
        self._interval_s = 0.0
        self.state = CameraState.IDLE
        self.words = ""

    def opening(self) -> None:
        """The camera is being opened. A lost camera stays lost until it gives a picture."""
        self._last_at = None
        if self.state is not CameraState.LOST:
            self.state, self.words = CameraState.OPENING, ""

    def picture(self, now: float) -> None:
        """The camera gave a picture."""
        if self._last_at is not None:
            interval_s = min(now - self._last_at, _MAX_INTERVAL_S)
            self._interval_s += _SMOOTHING * (interval_s - self._interval_s)
        self._last_at = now
        self.state, self.words = CameraState.LIVE, ""

    def lost(self, words: str) -> None:
        """The camera cannot be opened, or is gone."""
        self._last_at = None
        self.state, self.words = CameraState.LOST, words

    def closed(self) -> None:
        """The camera was closed, because its pictures are not needed."""
        self._last_at = None
        self.state, self.words = CameraState.IDLE, ""

    @property
    def may_be_silent_s(self) -> float:
        """Maximum time without a picture before the camera counts as lost."""
        return max(SILENT_S, _SILENT_PICTURES * self._interval_s)

    def tick(self, now: float) -> None:
        """Checks for silence."""
        if self.state is CameraState.LIVE and self._last_at is not None and now - self._last_at > self.may_be_silent_s:
            self.state, self.words = CameraState.LOST, f"{self._name}: gives no pictures any more"
