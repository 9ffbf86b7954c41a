"""What the drone did in a manoeuvre beside what the fitted model says, for a plot. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from server.identification.core.first_order import FirstOrder, Manoeuvre, Samples, modelled

MAX_TRACES: Final = 6
"""Of an axis, those with the greatest deflection."""
MAX_POINTS: Final = 200
"""Of a trace."""


class Trace(NamedTuple):
    """`began_s`: by the clock of the flight. `times_s`: since then. `given`: deflection, -1 to 1. `got`, `model`: in
    the unit of the axis."""

    began_s: float
    times_s: list[float]
    given: list[float]
    got: list[float]
    model: list[float]


def traces(manoeuvres: Sequence[Manoeuvre], found: FirstOrder) -> list[Trace]:
    """In order of time."""
    largest = sorted(manoeuvres, key=lambda one: -float(np.ptp(one.given)))[:MAX_TRACES]
    return [_trace(one, found) for one in sorted(largest, key=lambda one: float(one.times_s[0]))]


def _trace(one: Manoeuvre, found: FirstOrder) -> Trace:
    since_s = one.times_s - one.times_s[0]
    model = modelled(one, found.gain, found.tau_s, found.delay_s)
    step = max(1, -(-len(since_s) // MAX_POINTS))
    return Trace(
        float(one.times_s[0]),
        _rounded(since_s[::step]),
        _rounded(one.given[::step]),
        _rounded(one.got[::step]),
        _rounded(model[::step]),
    )


def _rounded(values: Samples) -> list[float]:
    return [round(float(one), 4) for one in values]
