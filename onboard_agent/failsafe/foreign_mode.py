"""A mode that nobody here requested: a radio pilot's switch, another ground station, a failsafe. No I/O."""

from typing import Final

FOREIGN_FOR_S: Final = 0.6
"""A mode shown for this long is not a delayed heartbeat."""


class ForeignMode:
    """Tell it of each heartbeat; ask `mode`."""

    def __init__(self) -> None:
        self._mode: int | None = None
        self._since = 0.0

    def forget(self) -> None:
        """Another mode was requested here."""
        self._mode = None

    def shown(self, custom_mode: int, *, ours: int | None, now: float) -> None:
        """A heartbeat shows this mode. `ours`: the one that was confirmed; None while that is not settled."""
        if ours is None or custom_mode == ours:
            self._mode = None
        elif self._mode != custom_mode:
            self._mode, self._since = custom_mode, now

    def mode(self, now: float) -> int | None:
        """The mode, once it has been there for a while."""
        return self._mode if self._mode is not None and now - self._since >= FOREIGN_FOR_S else None
