"""What flies the jet beside the cascade: the gimbal keeps it vertical, the throttle keeps the height.

The engine's controller takes throttle in whole steps. The integral stops at its limits and while the throttle is at its
own; it still winds up, because the turbine follows seconds later.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulator.control.cascade import Motion
from simulator.control.reference import Reference
from simulator.physics.jet_quadrotor import JetQuadrotorDesign
from simulator.physics.rotation import Floats, limited, to_euler


@dataclass(frozen=True, slots=True)
class JetGains:
    """Share of the full speed per metre, metre per second and metre second."""

    height_p: float = 0.03
    height_d: float = 0.05
    height_i: float = 0.004
    max_learned: float = 0.15
    step: float = 0.01
    """Of the engine's throttle."""
    dead_band_m: float = 0.0
    map_error: float = 0.0
    """By which the governor's idea of the speed that carries the weight is wrong."""


class JetGovernor:
    def __init__(self, design: JetQuadrotorDesign, count: int, gains: JetGains | None = None) -> None:
        self.gains = gains or JetGains()
        self._idle = design.jet.idle_share
        self._carrying = design.carrying_share + self.gains.map_error
        self._learned = np.zeros(count)

    def command(self, motion: Motion, reference: Reference, dt_s: float) -> tuple[Floats, Floats]:
        """Returns the throttle, (vehicles,), and the gimbal's angles, (2, vehicles)."""
        gains = self.gains
        place, speed = reference.position_m, reference.velocity_mps
        wanted_m, wanted_mps = place[2], speed[2]
        higher = motion.position_m[2] - wanted_m
        higher = np.sign(higher) * np.maximum(np.abs(higher) - gains.dead_band_m, 0.0)
        faster = motion.velocity_mps[2] - wanted_mps
        throttle = self._carrying + gains.height_p * higher + gains.height_d * faster + self._learned
        free = (throttle < 1.0) & (throttle > self._idle)
        learned = self._learned + gains.height_i * higher * free * dt_s
        self._learned = limited(learned, -gains.max_learned, gains.max_learned)
        stepped = gains.step * np.round(throttle / gains.step)
        return limited(stepped, self._idle, 1.0), -to_euler(motion.attitude)[:2]
