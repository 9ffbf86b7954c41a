"""How every sensor is read: at its rate, late by its delay. The physics' step is the smallest unit of time."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from simulator.physics.rotation import Floats


@dataclass(frozen=True, slots=True)
class Reading:
    """One measurement of all vehicles. `fresh` is False for those from which nothing came."""

    taken_s: float
    value: Floats
    fresh: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


@dataclass(slots=True)
class Sampling:
    """Decides when to measure, and holds measurements back for the delay. The queue is as long as the delay."""

    rate_hz: float
    delay_s: float = 0.0
    _due_s: float = 0.0
    _waiting: deque[Reading] = field(default_factory=deque)

    def due(self, now_s: float) -> bool:
        if now_s < self._due_s - 1e-9:
            return False
        self._due_s = max(self._due_s + 1.0 / self.rate_hz, now_s)
        return True

    def put(self, reading: Reading) -> None:
        self._waiting.append(reading)

    def take(self, now_s: float) -> Reading | None:
        """Returns the newest measurement that has arrived since the last call."""
        arrived = None
        while self._waiting and self._waiting[0].taken_s + self.delay_s <= now_s + 1e-9:
            arrived = self._waiting.popleft()
        return arrived
