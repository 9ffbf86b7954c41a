"""What a flight was like: truth, estimate and reference at a steady rate, and how well each measurement fitted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from simulator.control.reference import Reference
from simulator.firmware.controller import Fleet
from simulator.physics.rotation import Floats, conjugate, multiply, to_euler, to_vector

CHI_SQUARED_95 = {1: 3.841, 2: 5.991, 3: 7.815}
"""95 % of what is chi-squared with so many degrees of freedom is below."""


@dataclass(slots=True)
class Fit:
    """Of one kind of measurement."""

    components: int
    normalised: list[Floats] = field(default_factory=list)

    @property
    def share_inside(self) -> float:
        """Share of measurements within the 95 % bound."""
        return float(np.mean(np.array(self.normalised) < CHI_SQUARED_95[self.components]))

    @property
    def mean(self) -> float:
        """1 for a filter that judges itself rightly."""
        return float(np.mean(self.normalised)) / self.components


class Recorder:
    """`note` is called after each step; every array is (samples, axes, vehicles)."""

    def __init__(self, fleet: Fleet, period_s: float = 0.1) -> None:
        self._fleet = fleet
        self._period_s = period_s
        self._due_s = fleet.now_s
        self._columns: dict[str, list[Floats]] = {}
        self.times_s: list[float] = []
        self.fits: dict[str, Fit] = {}

    def note(self) -> None:
        fleet = self._fleet
        for kind, fused in fleet.filter.fused.items():
            fit = self.fits.setdefault(kind, Fit(fused.components))
            fit.normalised.append(fused.normalised)
        fleet.filter.fused.clear()
        if fleet.now_s < self._due_s - 1e-9:
            return
        self._due_s += self._period_s
        body, state = fleet.body, fleet.filter.state
        self.times_s.append(fleet.now_s)
        turn = to_vector(multiply(conjugate(state.attitude), body.attitude))
        self._put("position_m", body.position_m)
        self._put("velocity_mps", body.velocity_mps)
        self._put("attitude_deg", np.degrees(to_euler(body.attitude)))
        self._put("estimate_m", state.position_m)
        self._put("estimate_deg", np.degrees(to_euler(state.attitude)))
        self._put("attitude_error_deg", np.degrees(turn))
        self._put("commands", fleet.commands)
        self._put("reference_m", _place(fleet.reference, body.position_m))

    def _put(self, name: str, value: Floats) -> None:
        self._columns.setdefault(name, []).append(np.array(value))

    def column(self, name: str) -> Floats:
        return np.array(self._columns[name])

    @property
    def names(self) -> list[str]:
        return list(self._columns)

    def position_error_m(self) -> Floats:
        return self.column("estimate_m") - self.column("position_m")

    def tracking_error_m(self) -> Floats:
        """Reference less estimate: what the controller is answerable for."""
        return self.column("reference_m") - self.column("estimate_m")


def _place(reference: Reference | None, otherwise: Floats) -> Floats:
    if reference is None:
        return otherwise
    place = reference.position_m
    return np.broadcast_to(place[:, np.newaxis] if place.ndim == 1 else place, otherwise.shape)


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def level(values: Floats) -> Floats:
    """The length of the first two axes, (samples, vehicles)."""
    return np.hypot(values[:, 0], values[:, 1])
