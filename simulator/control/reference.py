"""Where the vehicles are to be at an instant: what a planner says and a controller follows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.physics.rotation import Floats


@dataclass(frozen=True, slots=True)
class Reference:
    """North, east, down; each (3,) for all vehicles alike or (3, vehicles)."""

    position_m: Floats
    velocity_mps: Floats
    acceleration_mss: Floats
    yaw_rad: float = 0.0

    def moved(self, offset_m: Floats) -> Reference:
        """The same for vehicles that stand elsewhere: `offset_m` is (3, vehicles)."""
        return Reference(
            self.position_m[:, np.newaxis] + offset_m,
            np.broadcast_to(self.velocity_mps[:, np.newaxis], offset_m.shape),
            np.broadcast_to(self.acceleration_mss[:, np.newaxis], offset_m.shape),
            self.yaw_rad,
        )


class Way(Protocol):
    """A flight as a function of time."""

    def at(self, time_s: float) -> Reference:
        """`time_s`: since its beginning."""


def standing(position_m: Floats, yaw_rad: float = 0.0) -> Reference:
    zero = np.zeros_like(position_m)
    return Reference(position_m, zero, zero, yaw_rad)
