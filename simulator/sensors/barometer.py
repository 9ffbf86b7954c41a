"""Barometers: height from pressure, with noise, and an error that grows as the board warms up."""

from __future__ import annotations

import math

import numpy as np

from simulator.physics.rotation import Floats
from simulator.sensors.sampling import Reading, Sampling

RATE_HZ = 25.0
NOISE_M = 0.12
WARM_UP_K = 18.0
WARM_UP_S = 180.0
TEMPERATURE_M_PER_K = 0.05
"""Standard deviation between sensors; the factory calibration leaves `RESIDUAL_SHARE` of it."""
RESIDUAL_SHARE = 0.15
WANDER_M = 0.12
WANDER_TIME_S = 120.0
"""Weather and the flow round the vehicle."""


class Barometer:
    def __init__(self, count: int, random_source: np.random.Generator) -> None:
        self._random = random_source
        self._sampling = Sampling(RATE_HZ, delay_s=0.02)
        self._per_kelvin = TEMPERATURE_M_PER_K * random_source.standard_normal(count)
        self._compensation = self._per_kelvin * (1.0 + RESIDUAL_SHARE * random_source.standard_normal(count))
        self._wander = np.zeros(count)
        self.compensated = np.ones(count, dtype=np.bool_)
        self.present = np.ones(count, dtype=np.bool_)
        self.stuck = np.zeros(count, dtype=np.bool_)
        """Fault `stuck_baro`: the last height is repeated for ever."""
        self.silent = np.zeros(count, dtype=np.bool_)
        """Fault: what it says is no number."""
        self._last = np.zeros(count)

    def temperature_k(self, now_s: float) -> float:
        """Above the temperature at switch-on."""
        return WARM_UP_K * (1.0 - math.exp(-now_s / WARM_UP_S))

    def step(self, alt_m: Floats, now_s: float) -> Reading | None:
        """Returns the height above the place of the start, metres."""
        if self._sampling.due(now_s):
            warm = self.temperature_k(now_s)
            keep = math.exp(-1.0 / RATE_HZ / WANDER_TIME_S)
            fresh = self._random.standard_normal((2, alt_m.size))
            self._wander = keep * self._wander + WANDER_M * math.sqrt(1.0 - keep * keep) * fresh[0]
            error = self._per_kelvin * warm - np.where(self.compensated, self._compensation * warm, 0.0)
            read = alt_m + error + self._wander + NOISE_M * fresh[1]
            self._last = np.where(self.stuck, self._last, read)
            self._sampling.put(Reading(now_s, np.where(self.silent, np.nan, self._last), self.present.copy()))
        return self._sampling.take(now_s)
