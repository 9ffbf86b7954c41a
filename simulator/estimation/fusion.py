"""One measurement into the filter: innovation, gate, gain. Measured components are taken in one after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simulator.estimation.error_state import STATES
from simulator.physics.rotation import Floats

Flags = npt.NDArray[np.bool_]
GATE_SIGMAS = 5.0
"""A component farther off than this is not believed."""
MAX_SIGMAS = 1000.0
"""As far off as is told."""


@dataclass(frozen=True, slots=True)
class Component:
    """One number of a measurement: `slopes` says how it depends on which states, each (vehicles,) or a number."""

    innovation: Floats
    slopes: tuple[tuple[int, Floats | float], ...]
    variance: float


@dataclass(frozen=True, slots=True)
class Fused:
    """`normalised`: the sum of the squares of innovations, each divided by its own variance; for a filter that judges
    itself rightly, chi-squared with as many degrees of freedom as `components`."""

    normalised: Floats
    worst: Floats
    """The largest innovation in standard deviations."""
    accepted: Flags
    """All components within the gate."""
    measured: Flags
    components: int


def fuse(covariance: Floats, components: list[Component], measured: Flags) -> tuple[Floats, Fused]:
    """Changes `covariance` in place. Returns the estimated errors, (vehicles, states), and how well it fitted."""
    count = covariance.shape[0]
    error = np.zeros((count, STATES))
    normalised, worst = np.zeros(count), np.zeros(count)
    accepted = measured.copy()
    for component in components:
        # The first component tells the gain of the second: the covariance is that after the first.
        row = np.zeros((count, STATES))
        known = np.zeros(count)
        for state, slope in component.slopes:
            row += np.reshape(slope, (-1, 1)) * covariance[:, state, :]
            known += slope * error[:, state]
        variance = np.full(count, component.variance)
        for state, slope in component.slopes:
            variance += slope * row[:, state]
        left = component.innovation - known
        # What is no number is no measurement: nothing of it may reach a state.
        sigmas = np.where(np.isfinite(left), np.abs(left) / np.sqrt(variance), np.inf)
        usable = measured & (sigmas < GATE_SIGMAS)
        left = np.where(usable, left, 0.0)
        gain = row * (usable / variance)[:, np.newaxis]
        error += gain * left[:, np.newaxis]
        covariance -= gain[:, :, np.newaxis] * row[:, np.newaxis, :]
        far = np.minimum(np.where(measured, sigmas, 0.0), MAX_SIGMAS)
        normalised += far * far
        worst = np.maximum(worst, far)
        accepted &= usable
    return error, Fused(normalised, worst, accepted, measured, len(components))
