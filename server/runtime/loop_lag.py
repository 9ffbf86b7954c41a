"""How late the tower's event loop is: every frame waits this long."""

from __future__ import annotations

import time
from collections import deque
from typing import Final

from server.runtime.aligned_timers import rest

CHECK_EVERY_S: Final = 0.5
REMEMBERED: Final = 120
"""Samples of one minute."""


class LoopLag:
    def __init__(self) -> None:
        self._late_s: deque[float] = deque(maxlen=REMEMBERED)

    async def watch(self) -> None:
        """Runs until cancelled."""
        while True:
            due = await rest(CHECK_EVERY_S)
            self._late_s.append(max(0.0, time.monotonic() - due))

    @property
    def now_ms(self) -> float:
        return round(self._late_s[-1] * 1000, 2) if self._late_s else 0.0

    @property
    def worst_ms(self) -> float:
        """Maximum of the last minute."""
        return round(max(self._late_s, default=0.0) * 1000, 2)
