"""Wind: a steady part and gusts that wander around it, from a seeded generator. Near the ground it is weaker."""

from __future__ import annotations

import math
import random

GUST_TIME_S = 3.0
GUST_SHARE = 0.15
"""Standard deviation of the gusts as a share of the steady wind."""
UPDATE_S = 0.1
NO_GUST = (0.0, 0.0, 0.0)
NAMED_AT_M = 10.0
"""Above the ground: where weather reports measure. Higher up the wind stays as it is here."""
ROUGHNESS_M = 0.03
"""Of open grass, for the logarithmic profile."""
ROTORS_M = 0.25
"""Above the feet of the landing gear."""
_FULL = math.log1p(NAMED_AT_M / ROUGHNESS_M)


def share_at(height_m: float) -> float:
    """Returns the share of the named wind in which a vehicle flies whose feet are so high above the ground."""
    return min(math.log1p(max(height_m + ROTORS_M, 0.0) / ROUGHNESS_M) / _FULL, 1.0)


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

    def at(self, time_s: float, height_m: float = NAMED_AT_M) -> tuple[float, float, float]:
        """Returns north, east, down, metres per second: the direction in which the air moves around a vehicle so high
        above the ground. The height does not change a gust that somebody wants."""
        if self._spread and time_s >= self._next_s:
            self._next_s = time_s + UPDATE_S
            keep = math.exp(-UPDATE_S / GUST_TIME_S)
            fresh = self._spread * math.sqrt(1.0 - keep * keep)
            for axis in range(3):
                self._gust[axis] = keep * self._gust[axis] + fresh * self._random.gauss(0.0, 1.0)
            north, east = self.steady_mps
            self._now_mps = (north + self._gust[0], east + self._gust[1], 0.3 * self._gust[2])
        north, east, down = self._now_mps
        if self._spread and height_m < NAMED_AT_M:
            share = share_at(height_m)
            north, east, down = north * share, east * share, down * share
        gust_n, gust_e, gust_d = self.gust_mps
        return north + gust_n, east + gust_e, down + gust_d
