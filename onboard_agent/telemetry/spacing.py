"""Keeps messages that the agent requested faster for the black box at their usual rates towards the tower. No I/O."""

from collections.abc import Mapping
from typing import Final

from wire.frames import message_id, source

_EARLY: Final = 0.5
"""Of a period: two that come a little close are two, and those of the double rate are not."""


class Spacing:
    """`usual_hz`: by message. Others pass."""

    def __init__(self, usual_hz: Mapping[int, float]) -> None:
        self._period_s = {message: 1.0 / rate_hz for message, rate_hz in usual_hz.items()}
        self._due_at: dict[tuple[int, tuple[int, int]], float] = {}

    def admit(self, frames: list[bytes], now: float) -> list[bytes]:
        """Returns the frames that may go on."""
        return [frame for frame in frames if self._may_pass(frame, now)] if self._period_s else frames

    def _may_pass(self, frame: bytes, now: float) -> bool:
        kind = message_id(frame)
        period_s = self._period_s.get(kind)
        if period_s is None:
            return True
        key = (kind, source(frame))
        due_at = self._due_at.get(key, now)
        if now < due_at:
            return False
        # On a grid, so that what is a little late does not lower the rate.
        self._due_at[key] = max(due_at + period_s, now + _EARLY * period_s)
        return True
