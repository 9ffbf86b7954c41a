"""A four-cell lithium battery: charge, open-circuit voltage, sag under load."""

from __future__ import annotations

import bisect
import itertools
import math

from simulator.airframe import WEIGHT_N

CELLS = 4
RESISTANCE_OHM = 0.025
IDLE_A = 0.4
HOVER_A = 14.0
FULL_V = 4.2 * CELLS

_CELL_CURVE = ((0.0, 3.00), (0.05, 3.45), (0.2, 3.65), (0.5, 3.80), (0.8, 4.00), (1.0, 4.20))
"""Open-circuit volts of one cell over the remaining share of the charge."""


class Battery:
    def __init__(self, capacity_mah: float) -> None:
        self.capacity_mah = capacity_mah
        self.used_mah = 0.0
        self.current_a = IDLE_A
        self.voltage_v = FULL_V
        self.extra_ohm = 0.0
        """Of a bad plug."""

    @property
    def left(self) -> float:
        """Remaining share of the charge, 0..1."""
        return max(0.0, 1.0 - self.used_mah / self.capacity_mah)

    @property
    def power(self) -> float:
        """Share of the full thrust at this voltage; 0 once the battery is flat."""
        if self.left <= 0.0:
            return 0.0
        share = self.voltage_v / FULL_V
        return share * math.sqrt(share)

    def draw(self, thrust_n: float, dt_s: float) -> None:
        load = thrust_n / WEIGHT_N
        self.current_a = IDLE_A + HOVER_A * load * math.sqrt(load)
        self.used_mah += self.current_a * dt_s / 3.6
        self.voltage_v = CELLS * _cell_volts(self.left) - self.current_a * (RESISTANCE_OHM + self.extra_ohm)


_SEGMENTS = tuple((x0, v0, x1 - x0, v1 - v0) for (x0, v0), (x1, v1) in itertools.pairwise(_CELL_CURVE))
_SEGMENT_ENDS = tuple(share for share, _ in _CELL_CURVE[1:])


def _cell_volts(left: float) -> float:
    """`left`: 0..1."""
    from_share, from_v, over_share, over_v = _SEGMENTS[bisect.bisect_left(_SEGMENT_ENDS, left)]
    return from_v + over_v * (left - from_share) / over_share
