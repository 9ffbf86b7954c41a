"""Fits first order plus delay, `gain / (1 + tau s) * exp(-delay s)`, to what a drone did when its sticks moved. Pure.

For a given `tau` and delay the model is linear in the gain, and in an offset and a transient `exp(-t / tau)` of each
manoeuvre: the drone need not be at rest when one begins. So only `tau` and delay are searched, on a grid, which is then
refined around the best cell. Every manoeuvre of an axis counts in the same fit. The input is a straight
line between its samples: a stick moved at some time since the sample before, and to hold the older one would make every
delay half a sample too short.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Samples: TypeAlias = NDArray[np.float64]

MIN_TAU_S: Final = 0.02
MAX_TAU_S: Final = 4.0
MAX_DELAY_S: Final = 1.0
GRID: Final = 24
REFINEMENTS: Final = 5
WIDE: Final = 3
"""Cells to both sides that are refined: a longer delay makes up for a shorter time constant, so the optimum may lie
beyond the neighbours of the best cell."""
MIN_SAMPLES: Final = 8
"""Of a manoeuvre: four numbers are fitted."""
REST: Final = 0.04
"""Of full deflection. Sticks that move less are at rest."""
REST_S: Final = 0.5
MIN_DEFLECTION: Final = 0.15
MAX_LENGTH_S: Final = 4.0
MAX_MANOEUVRES: Final = 40
TINY: Final = 1e-9
MAX_GAP_S: Final = 0.5
"""Between samples. What is further apart belongs to no manoeuvre."""
PATTERN: Final = 0.5
"""Correlation of residuals from which they are no noise."""
NEGLIGIBLE: Final = 0.998
"""An r² from which residuals are rounding, whatever they look like."""
STEPS: Final = 4
"""Of the model, between two samples."""
RISE: Final = 2.197224577
"""ln 9: the rise from 10 % to 90 % takes that many time constants."""


@dataclass(frozen=True)
class Manoeuvre:
    """A part of a flight that begins at rest. `times_s`: of both, rising. `given`: deflection, -1 to 1. `got`: what the
    drone did, in the unit of the axis."""

    times_s: Samples
    given: Samples
    got: Samples


@dataclass(frozen=True)
class FirstOrder:
    """What fits best. `gain`: units of the axis for full deflection. `r_squared`: the part of the variance that the
    model explains, at most 1; below about 0.8 the drone did not act as such a system. `at_bound`: time constant or
    delay is at the end of what was searched, so no better than a bound. `sample_s`: median; nothing shorter can be
    told. `residual_correlation`: of what is left with itself a sample later, -1 to 1; about 0 is noise."""

    gain: float
    tau_s: float
    delay_s: float
    r_squared: float
    manoeuvres: int
    sample_s: float
    at_bound: bool
    residual_correlation: float = 0.0

    @property
    def is_patterned(self) -> bool:
        """Whether what the model leaves is no noise: the drone is of a higher order, or something else moved it. Then
        the numbers describe it less well than the r² suggests."""
        return self.residual_correlation > PATTERN and self.r_squared < NEGLIGIBLE

    @property
    def rise_s(self) -> float:
        """From 10 % to 90 % of a step."""
        return RISE * self.tau_s


def manoeuvres_in(times_s: Samples, given: Samples, got: Samples) -> list[Manoeuvre]:
    """Finds where sticks leave their rest, with half a second before and at most `MAX_LENGTH_S` in all. Samples that
    are not known are NaN. Returns at most `MAX_MANOEUVRES`, the first ones."""
    found: list[Manoeuvre] = []
    known = ~(np.isnan(given) | np.isnan(got))
    times_s, given, got = times_s[known], given[known], got[known]
    at, count = 1, len(times_s)
    while at < count and len(found) < MAX_MANOEUVRES:
        begin = int(np.searchsorted(times_s, times_s[at] - REST_S))
        if not _leaves_rest(times_s, given, begin, at):
            at += 1
            continue
        end = int(np.searchsorted(times_s, times_s[begin] + MAX_LENGTH_S, side="right"))
        gaps = np.flatnonzero(np.diff(times_s[at - 1 : end]) > MAX_GAP_S)
        end = at + int(gaps[0]) if len(gaps) else end
        moved = float(np.ptp(given[begin:end]))
        if end - begin >= MIN_SAMPLES and moved >= MIN_DEFLECTION:
            found.append(Manoeuvre(times_s[begin:end], given[begin:end], got[begin:end]))
        at = max(end, at + 1)
    return found


def _leaves_rest(times_s: Samples, given: Samples, begin: int, at: int) -> bool:
    """Whether the sticks rest from `begin` up to `at`, and move there."""
    if at - begin < 2 or times_s[at] - times_s[begin] < 0.8 * REST_S or abs(given[at] - given[begin]) <= REST:
        return False
    return bool(np.ptp(given[begin:at]) <= REST and np.all(np.diff(times_s[begin : at + 1]) <= MAX_GAP_S))


def fit(manoeuvres: Sequence[Manoeuvre]) -> FirstOrder | None:
    """Returns None if there is nothing to fit, or the drone did not move at all."""
    if not manoeuvres:
        return None
    sample_s = float(np.median(np.concatenate([np.diff(one.times_s) for one in manoeuvres])))
    taus = np.geomspace(MIN_TAU_S, MAX_TAU_S, GRID)
    delays = np.linspace(0.0, MAX_DELAY_S, GRID)
    tau_s = delay_s = gain = 0.0
    r_squared = -np.inf
    for _ in range(1 + REFINEMENTS):
        gains, scores = _judge(manoeuvres, taus, delays)
        if not np.isfinite(scores).any():
            break
        row, column = np.unravel_index(int(np.nanargmax(scores)), scores.shape)
        if scores[row, column] >= r_squared:
            tau_s, delay_s = float(taus[row]), float(delays[column])
            gain, r_squared = float(gains[row, column]), float(scores[row, column])
        taus, delays = _around(taus, int(row)), _around(delays, int(column))
    if not np.isfinite(r_squared):
        return None
    at_bound = tau_s <= MIN_TAU_S * 1.01 or tau_s >= MAX_TAU_S * 0.99 or delay_s >= MAX_DELAY_S * 0.99
    left = [one.got - modelled(one, gain, tau_s, delay_s) for one in manoeuvres]
    alike = _correlation_later(left)
    return FirstOrder(gain, tau_s, delay_s, r_squared, len(manoeuvres), sample_s, at_bound, alike)


def modelled(one: Manoeuvre, gain: float, tau_s: float, delay_s: float) -> Samples:
    """Returns what the model says of a manoeuvre, with its offset and its transient: the drone need not be at rest when
    one begins, nor at zero."""
    unit = respond(one, np.array([tau_s]), np.array([delay_s]))[:, 0, 0]
    since_s = one.times_s - one.times_s[0]
    basis = np.stack([np.ones_like(since_s), np.exp(-since_s / tau_s)], axis=1)
    weights, *_ = np.linalg.lstsq(basis, one.got - gain * unit, rcond=None)
    return np.asarray(gain * unit + basis @ weights)


def _correlation_later(left: Sequence[Samples]) -> float:
    """Returns how much residuals resemble those of the sample before."""
    power = sum(float(one @ one) for one in left)
    return sum(float(one[1:] @ one[:-1]) for one in left) / power if power > TINY else 0.0


def _around(values: Samples, best: int) -> Samples:
    """A finer grid around the best value."""
    return np.linspace(values[max(0, best - WIDE)], values[min(len(values) - 1, best + WIDE)], GRID)


def _judge(manoeuvres: Sequence[Manoeuvre], taus: Samples, delays: Samples) -> tuple[Samples, Samples]:
    """For each pair of time constant and delay the best gain, and the part of the variance that is explained."""
    shape = len(taus), len(delays)
    xx, xy, explained, total = np.zeros(shape), np.zeros(shape), np.zeros(shape), 0.0
    for one in manoeuvres:
        model = respond(one, taus, delays)
        got = one.got - one.got.mean()
        total += float(got @ got)
        since_s = one.times_s - one.times_s[0]
        for row, tau_s in enumerate(taus):
            basis, _ = np.linalg.qr(np.stack([np.ones_like(since_s), np.exp(-since_s / tau_s)], axis=1))
            alone = basis.T @ got  # what offset and transient explain without the input
            rest, moved = got - basis @ alone, model[:, row] - basis @ (basis.T @ model[:, row])
            explained[row] += float(alone @ alone)
            xx[row] += (moved**2).sum(axis=0)
            xy[row] += rest @ moved
    xx[xx < TINY] = np.nan
    return xy / xx, (explained + xy**2 / xx) / total if total > TINY else np.full(shape, np.nan)


def respond(manoeuvre: Manoeuvre, taus: Samples, delays: Samples) -> Samples:
    """Returns what a system with gain 1 does, of shape (samples, time constants, delays). It is at rest before.

    The delayed input bends between two samples of the answer: hence the steps in between.
    """
    times, given = manoeuvre.times_s, manoeuvre.given
    state = np.full((len(taus), len(delays)), given[0])
    out = np.empty((len(times), len(taus), len(delays)))
    out[0] = state
    for at in range(1, len(times)):
        step_s = (times[at] - times[at - 1]) / STEPS
        keep = np.exp(-step_s / taus)[:, None]
        for part in range(STEPS):
            middle_s = times[at - 1] + (part + 0.5) * step_s - delays
            moved = np.interp(middle_s, times, given)[None, :]
            state = moved + (state - moved) * keep
        out[at] = state
    return out
