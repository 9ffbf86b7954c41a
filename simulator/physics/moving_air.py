"""The air that many vehicles fly in: a steady wind, turbulence that wanders around it, and single gusts."""

from __future__ import annotations

import math

import numpy as np

from simulator.physics.rotation import Floats

TURBULENCE_TIME_S = 3.0
VERTICAL_SHARE = 0.3
"""Of the turbulence near the ground."""


class MovingAir:
    """Each vehicle has its own turbulence; `step` must be called once a step."""

    def __init__(
        self,
        count: int,
        random_source: np.random.Generator,
        *,
        speed_mps: float = 0.0,
        from_deg: float = 0.0,
        gust_share: float = 0.15,
    ) -> None:
        """`gust_share`: standard deviation of the turbulence as a share of the steady wind."""
        towards = math.radians(from_deg + 180.0)
        self._steady = np.zeros((3, count))
        self._steady[0], self._steady[1] = speed_mps * math.cos(towards), speed_mps * math.sin(towards)
        self._spread = np.array([[1.0], [1.0], [VERTICAL_SHARE]]) * (gust_share * speed_mps)
        self._calm = gust_share * speed_mps == 0.0
        self._random = random_source
        self._turbulence = self._spread * random_source.standard_normal((3, count))
        self._gust_mps = np.zeros((3, count))
        self._gust_from_s = np.full(count, -math.inf)
        self._gust_for_s = np.ones(count)

    def gust(self, vehicle: int, velocity_mps: tuple[float, float, float], now_s: float, duration_s: float) -> None:
        """Adds a single gust that rises to `velocity_mps` and falls again, as a cosine."""
        self._gust_mps[:, vehicle] = velocity_mps
        self._gust_from_s[vehicle], self._gust_for_s[vehicle] = now_s, duration_s

    def step(self, now_s: float, dt_s: float) -> Floats:
        """Returns the velocity of the air at each vehicle, (3, vehicles)."""
        wind = self._steady
        if not self._calm:
            keep = math.exp(-dt_s / TURBULENCE_TIME_S)
            fresh = math.sqrt(1.0 - keep * keep)
            noise = self._random.standard_normal(self._turbulence.shape)
            self._turbulence = keep * self._turbulence + fresh * self._spread * noise
            wind = wind + self._turbulence
        share = (now_s - self._gust_from_s) / self._gust_for_s
        blowing = (share > 0.0) & (share < 1.0)
        if blowing.any():
            rise = np.where(blowing, 0.5 - 0.5 * np.cos(2.0 * np.pi * np.clip(share, 0.0, 1.0)), 0.0)
            wind = wind + self._gust_mps * rise
        return wind
