"""Wind: a steady part and gusts that wander around it, from a seeded generator."""

from __future__ import annotations

import math
import random

GUST_TIME_S = 3.0
GUST_SHARE = 0.15
"""Standard deviation of the gusts as a share of the steady wind."""
UPDATE_S = 0.1
NO_GUST = (0.0, 0.0, 0.0)


class Wind:
    """`at` must be called with times that never decrease."""

    def __init__(self, speed_mps: float, from_deg: float, random_source: random.Random) -> None:
        towards = math.radians(from_deg + 180.0)
        self.steady_mps = (speed_mps * math.cos(towards), speed_mps * math.sin(towards))
        self._spread = GUST_SHARE * speed_mps
        self._random = random_source
        self.gust_mps = NO_GUST
        """Added from outside: one gust that a test or a person wants."""
        self._gust = [0.0, 0.0, 0.0]
        self._next_s = 0.0
        self._now_mps = (*self.steady_mps, 0.0)

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Returns north, east, down, metres per second: the direction in which the air moves."""
        if self._spread and time_s >= self._next_s:
            self._next_s = time_s + UPDATE_S
            keep = math.exp(-UPDATE_S / GUST_TIME_S)
            fresh = self._spread * math.sqrt(1.0 - keep * keep)
            for axis in range(3):
                self._gust[axis] = keep * self._gust[axis] + fresh * self._random.gauss(0.0, 1.0)
            north, east = self.steady_mps
            self._now_mps = (north + self._gust[0], east + self._gust[1], 0.3 * self._gust[2])
        if self.gust_mps is NO_GUST:
            return self._now_mps
        (north, east, down), (gust_n, gust_e, gust_d) = self._now_mps, self.gust_mps
        return north + gust_n, east + gust_e, down + gust_d
