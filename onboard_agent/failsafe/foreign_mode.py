"""Detects a mode that neither tower nor agent requested: radio switch, another ground station, failsafe. No I/O."""

from typing import Final

FOREIGN_FOR_S: Final = 0.6
"""A mode shown for this long does not come from an outdated heartbeat."""


class ForeignMode:
    """Call `shown` for each heartbeat; query `mode`."""

    def __init__(self) -> None:
        self._mode: int | None = None
        self._since = 0.0

    def forget(self) -> None:
        """Resets the detection, because the tower or the agent requests another mode."""
        self._mode = None

    def shown(self, custom_mode: int, *, ours: int | None, now: float) -> None:
        """A heartbeat shows this mode. `ours`: the confirmed mode, or None while none is settled."""
        if ours is None or custom_mode == ours:
            self._mode = None
        elif self._mode != custom_mode:
            self._mode, self._since = custom_mode, now

    def mode(self, now: float) -> int | None:
        """Returns the mode once it has been shown for FOREIGN_FOR_S, or None."""
        return self._mode if self._mode is not None and now - self._since >= FOREIGN_FOR_S else None
