"""Batteries of many vehicles: charge, voltage that sags under load, and what the power module reads of it."""

from __future__ import annotations

import numpy as np

from simulator.physics.rotation import Floats

CELLS = 4
RESISTANCE_OHM = 0.025
IDLE_A = 0.4
HOVER_A = 14.0
FULL_V = 4.2 * CELLS
RECOVERY_S = 1.5
"""The chemistry follows a change of load more slowly than the plain resistance."""
SLOW_RESISTANCE_OHM = 0.010
VOLTAGE_NOISE_V = 0.02
CURRENT_NOISE_A = 0.15

_SHARE = np.array([0.0, 0.05, 0.2, 0.5, 0.8, 1.0])
_CELL_V = np.array([3.00, 3.45, 3.65, 3.80, 4.00, 4.20])
"""Open-circuit volts of one cell over the remaining share of the charge."""


class Batteries:
    def __init__(self, count: int, random_source: np.random.Generator, capacity_mah: float = 5200.0) -> None:
        self._random = random_source
        self.capacity_mah = capacity_mah
        self.used_mah = np.zeros(count)
        self.current_a = np.full(count, IDLE_A)
        self.voltage_v = np.full(count, FULL_V)
        self.extra_resistance_ohm = np.zeros(count)
        """Fault `battery_sag`: a bad cell or plug."""
        self._slow_a = np.full(count, IDLE_A)

    @property
    def left(self) -> Floats:
        return np.maximum(0.0, 1.0 - self.used_mah / self.capacity_mah)

    @property
    def power(self) -> Floats:
        """Share of the full thrust at this voltage; 0 once the battery is flat."""
        return np.where(self.left > 0.0, np.clip(self.voltage_v / FULL_V, 0.0, 1.0) ** 1.5, 0.0)

    def step(self, load: Floats, dt_s: float) -> None:
        """`load`: thrust as a share of the weight."""
        self.current_a = IDLE_A + HOVER_A * load * np.sqrt(load)
        self.used_mah += self.current_a * dt_s / 3.6
        self._slow_a += (self.current_a - self._slow_a) * (dt_s / (RECOVERY_S + dt_s))
        open_v = CELLS * np.interp(self.left, _SHARE, _CELL_V)
        sag_v = self.current_a * (RESISTANCE_OHM + self.extra_resistance_ohm) + self._slow_a * SLOW_RESISTANCE_OHM
        self.voltage_v = np.maximum(open_v - sag_v, 0.0)

    def read(self) -> Floats:
        """Returns volts and amperes as measured, (2, vehicles)."""
        noise = self._random.standard_normal((2, self.used_mah.size))
        return np.array([self.voltage_v + VOLTAGE_NOISE_V * noise[0], self.current_a + CURRENT_NOISE_A * noise[1]])
