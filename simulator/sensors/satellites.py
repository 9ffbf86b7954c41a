"""GPS receivers: fix states, a position error that wanders, velocity, delay, loss and jumps.

The error has three parts. Orbits, clocks and atmosphere move it slowly: the troposphere's error, for example, keeps
15 to 45 minutes (Navigation, Journal of the ION, overbounds after Joerger and Pervan 2020), those of orbits longer. Its
size is the data sheet's: 1.5 m horizontally for u-blox M10, taken as CEP. Multipath changes within a minute: the
measured autocorrelation of a consumer receiver bends there and falls slowly for an hour after it (D. Wilson, "GPS
correlation of errors"). The rest is noise. Velocity comes from the Doppler shift, which has none of the slow errors;
u-blox gives 0.05 m/s for M8.
"""

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
SLOW_M = (1.27, 1.27, 2.5)
"""Standard deviations; 1.27 m is 1.5 m CEP over 1.1774."""
SLOW_TIME_S = 1800.0
MULTIPATH_M = (0.25, 0.25, 0.5)
MULTIPATH_TIME_S = 60.0
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


class Wander:
    """An error that forgets itself exponentially (first-order Gauss-Markov), (3, vehicles)."""

    def __init__(self, spread_m: tuple[float, float, float], time_s: float, first: Floats) -> None:
        """`first`: where it begins, in standard deviations."""
        self._spread_m, self._time_s = np.reshape(spread_m, (3, 1)), time_s
        self.error_m = self._spread_m * first

    def step(self, over_s: float, fresh: Floats) -> None:
        """`fresh`: standard normal."""
        keep = math.exp(-over_s / self._time_s)
        self.error_m = keep * self.error_m + (math.sqrt(1.0 - keep * keep) * self._spread_m) * fresh


class GpsReceiver:
    def __init__(self, count: int, random_source: np.random.Generator, *, warm_start: bool = False) -> None:
        self._random = random_source
        self._sampling = Sampling(RATE_HZ, DELAY_S)
        self.slow = Wander(SLOW_M, SLOW_TIME_S, random_source.standard_normal((3, count)))
        self.multipath = Wander(MULTIPATH_M, MULTIPATH_TIME_S, random_source.standard_normal((3, count)))
        self.lost = np.zeros(count, dtype=np.bool_)
        """Fault `gps_loss`."""
        self.jump_m = np.zeros((3, count))
        """Fault `gps_jump`: all later positions are off by this."""
        self.silent = np.zeros(count, dtype=np.bool_)
        """Fault: what it says is no number."""
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
            fresh = self._random.standard_normal((4, *position_m.shape))
            self.slow.step(1.0 / RATE_HZ, fresh[0])
            self.multipath.step(1.0 / RATE_HZ, fresh[1])
            place = position_m + self.slow.error_m + self.multipath.error_m + self.jump_m
            place += np.reshape(NOISE_M, (3, 1)) * fresh[2]
            motion = velocity_mps + np.reshape(VELOCITY_NOISE_MPS, (3, 1)) * fresh[3]
            said = np.where(self.silent, np.nan, np.concatenate((place, motion)))
            self._sampling.put(Reading(now_s, said, self.fix >= Fix.FIX_3D))
        return self._sampling.take(now_s)

    def _search(self, now_s: float) -> None:
        gone = self.lost | ~self.present
        self._seen_since_s = np.where(gone, now_s, self._seen_since_s)
        self._search_s = np.where(gone, REACQUIRE_S / 2.0, self._search_s)
        seen_s = now_s - self._seen_since_s
        found = np.where(seen_s >= 2.0 * self._search_s, Fix.FIX_3D, Fix.FIX_2D)
        found = np.where(seen_s >= self._search_s, found, Fix.NO_FIX)
        self.fix = np.where(self.present, np.where(gone, Fix.NO_FIX, found), Fix.NO_GPS)
