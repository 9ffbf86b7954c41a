"""GPS receivers: fix states, a position error that wanders, velocity, delay, loss and jumps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from simulator.physics.rotation import Floats
from simulator.sensors.sampling import Reading, Sampling


class Fix(IntEnum):
    """As GPS_RAW_INT numbers them."""

    NO_GPS = 0
    NO_FIX = 1
    FIX_2D = 2
    FIX_3D = 3
    DGPS = 4


RATE_HZ = 5.0
DELAY_S = 0.12
WANDER_M = (0.6, 0.6, 1.2)
WANDER_TIME_S = 60.0
NOISE_M = (0.15, 0.15, 0.3)
VELOCITY_NOISE_MPS = (0.08, 0.08, 0.15)
SEARCH_S = 4.0
"""From switch-on to a two-dimensional fix; a three-dimensional one takes as long again."""
REACQUIRE_S = 2.0
"""After a loss."""
SATELLITES = 14


@dataclass(frozen=True, slots=True)
class Satellites:
    """What the receivers say beside position and velocity."""

    fix: np.ndarray[tuple[int, ...], np.dtype[np.int64]]
    in_use: np.ndarray[tuple[int, ...], np.dtype[np.int64]]


class GpsReceiver:
    def __init__(self, count: int, random_source: np.random.Generator, *, warm_start: bool = False) -> None:
        self._random = random_source
        self._sampling = Sampling(RATE_HZ, DELAY_S)
        self.wander_m = np.reshape(WANDER_M, (3, 1)) * random_source.standard_normal((3, count))
        self.lost = np.zeros(count, dtype=np.bool_)
        """Fault `gps_loss`."""
        self.jump_m = np.zeros((3, count))
        """Fault `gps_jump`: all later positions are off by this."""
        self.present = np.ones(count, dtype=np.bool_)
        self._seen_since_s = np.full(count, -math.inf if warm_start else 0.0)
        self._search_s = np.full(count, SEARCH_S)
        self.fix = np.full(count, Fix.FIX_3D if warm_start else Fix.NO_FIX, dtype=np.int64)

    def status(self) -> Satellites:
        return Satellites(self.fix, np.where(self.fix >= Fix.FIX_2D, SATELLITES, 0))

    def step(self, position_m: Floats, velocity_mps: Floats, now_s: float) -> Reading | None:
        """Returns position and velocity, (6, vehicles), north, east, down. `fresh` means a three-dimensional fix."""
        if self._sampling.due(now_s):
            self._search(now_s)
            keep = math.exp(-1.0 / RATE_HZ / WANDER_TIME_S)
            fresh = self._random.standard_normal((3, *position_m.shape))
            spread = np.reshape(WANDER_M, (3, 1)) * math.sqrt(1.0 - keep * keep)
            self.wander_m = keep * self.wander_m + spread * fresh[0]
            place = position_m + self.wander_m + self.jump_m + np.reshape(NOISE_M, (3, 1)) * fresh[1]
            motion = velocity_mps + np.reshape(VELOCITY_NOISE_MPS, (3, 1)) * fresh[2]
            self._sampling.put(Reading(now_s, np.concatenate((place, motion)), self.fix >= Fix.FIX_3D))
        return self._sampling.take(now_s)

    def _search(self, now_s: float) -> None:
        gone = self.lost | ~self.present
        self._seen_since_s = np.where(gone, now_s, self._seen_since_s)
        self._search_s = np.where(gone, REACQUIRE_S / 2.0, self._search_s)
        seen_s = now_s - self._seen_since_s
        found = np.where(seen_s >= 2.0 * self._search_s, Fix.FIX_3D, Fix.FIX_2D)
        found = np.where(seen_s >= self._search_s, found, Fix.NO_FIX)
        self.fix = np.where(self.present, np.where(gone, Fix.NO_FIX, found), Fix.NO_GPS)
