"""Calibration of magnetometers: flown (samples while the vehicle turns and leans), fitted, saved and loaded.

The fit finds the offset and the scale of each axis that turn every sample into the earth's field as the vehicle's
attitude shows it. Roll and pitch are known without a compass; the heading is known from the gyroscope but for its
start, which the fit finds too. A fit to a sphere alone fails here: a copter cannot fly upside down, and what it sees of
the sphere hardly tells a larger one from one that is displaced.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from simulator.physics.rotation import Floats, matrix, to_euler

MIN_SAMPLES = 100
MIN_SECTORS = 11
"""Of twelve headings that the vehicle took, as its gyroscope counts them; fewer: turn it farther."""
MAX_RESIDUAL_GAUSS = 0.02
MAX_OFFSET_GAUSS = 0.6
MAX_SCALE_ERROR = 0.3
SCALE_PRIOR = 0.05
OFFSET_PRIOR_GAUSS = 0.15
"""Standard deviations of scales from 1 and of offsets from 0 before any sample."""
SAMPLE_GAUSS = 0.004
_ROUNDS = 10


class CalibrationRefused(ValueError):
    """The samples allow no calibration; the text says why."""


@dataclass(frozen=True, slots=True)
class MagnetometerCalibration:
    """`offset_gauss` and `scale`: (3, vehicles)."""

    offset_gauss: Floats
    scale: Floats

    @classmethod
    def none(cls, count: int) -> MagnetometerCalibration:
        return cls(np.zeros((3, count)), np.ones((3, count)))

    def corrected(self, raw_gauss: Floats) -> Floats:
        return np.asarray((raw_gauss - self.offset_gauss) / self.scale)

    def to_json(self) -> str:
        return json.dumps({"offset_gauss": self.offset_gauss.T.tolist(), "scale": self.scale.T.tolist()})

    @classmethod
    def from_json(cls, text: str) -> MagnetometerCalibration:
        """Raises CalibrationRefused if this is not a calibration that `to_json` wrote."""
        try:
            stored = json.loads(text)
            offset = np.asarray(stored["offset_gauss"], dtype=np.float64).T
            scale = np.asarray(stored["scale"], dtype=np.float64).T
        except (ValueError, KeyError, TypeError) as error:
            raise CalibrationRefused("this is not a stored calibration") from error
        sound = offset.ndim == 2 and offset.shape[0] == 3 and offset.shape == scale.shape
        if not sound or not np.isfinite(offset).all() or not (np.abs(scale - 1.0) < 0.5).all():
            raise CalibrationRefused("the stored calibration is damaged")
        if (np.abs(offset) > MAX_OFFSET_GAUSS).any():
            raise CalibrationRefused("the stored calibration is damaged")
        return cls(offset, scale)


def fit(samples_gauss: Floats, attitudes: Floats, field_gauss: Floats) -> MagnetometerCalibration:
    """Raises CalibrationRefused.

    `samples_gauss`: (3, vehicles, samples), uncalibrated. `attitudes`: (4, vehicles, samples), right but for a constant
    error of the heading. `field_gauss`: the earth's field at the place, (3, 1).
    """
    count, number = samples_gauss.shape[1:]
    if number < MIN_SAMPLES:
        raise CalibrationRefused(f"{number} samples of {MIN_SAMPLES}")
    fitted = []
    for vehicle in range(count):
        name = f"vehicle {vehicle + 1}"
        sectors = np.floor(to_euler(attitudes[:, vehicle])[2] % (2.0 * np.pi) * 6.0 / np.pi)
        if np.unique(sectors).size < MIN_SECTORS:
            raise CalibrationRefused(f"{name}: turned too little")
        offset, scale, residual_gauss = _fit_one(samples_gauss[:, vehicle], matrix(attitudes[:, vehicle]), field_gauss)
        if residual_gauss > MAX_RESIDUAL_GAUSS:
            raise CalibrationRefused(f"{name}: the samples do not follow its motion")
        if (np.abs(offset) > MAX_OFFSET_GAUSS).any() or (np.abs(scale - 1.0) > MAX_SCALE_ERROR).any():
            raise CalibrationRefused(f"{name}: the offsets are too large")
        fitted.append((offset, scale))
    offsets, scales = zip(*fitted, strict=True)
    return MagnetometerCalibration(np.stack(offsets, axis=1), np.stack(scales, axis=1))


def _fit_one(samples: Floats, rotation: Floats, field: Floats) -> tuple[Floats, Floats, float]:
    """Gauss and Newton's method on offset, scale and the error of the heading."""
    level, declination = float(np.hypot(field[0, 0], field[1, 0])), float(np.arctan2(field[1, 0], field[0, 0]))
    offset, scale = _middle(samples), np.ones(3)
    seen = np.einsum("ijn,jn->i", rotation, samples - offset[:, np.newaxis])
    heading = float(np.arctan2(seen[1], seen[0])) - declination
    prior = np.repeat([(SAMPLE_GAUSS / OFFSET_PRIOR_GAUSS) ** 2, (SAMPLE_GAUSS / SCALE_PRIOR) ** 2, 0.0], (3, 3, 1))
    number = samples.shape[1]
    residual = samples
    for _ in range(_ROUNDS):
        angle = declination + heading
        world = np.array([level * np.cos(angle), level * np.sin(angle), field[2, 0]])
        across = np.array([-level * np.sin(angle), level * np.cos(angle), 0.0])
        wanted, turned = np.einsum("jin,j->in", rotation, world), np.einsum("jin,j->in", rotation, across)
        residual = samples - scale[:, np.newaxis] * wanted - offset[:, np.newaxis]
        normal, pull = np.diag(prior), -prior * np.concatenate((offset, scale - 1.0, [0.0]))
        for axis in range(3):
            slope = np.zeros((7, number))
            slope[axis], slope[3 + axis], slope[6] = 1.0, wanted[axis], scale[axis] * turned[axis]
            normal, pull = normal + slope @ slope.T, pull + slope @ residual[axis]
        step = np.linalg.solve(normal, pull)
        offset, scale, heading = offset + step[:3], scale + step[3:6], heading + float(step[6])
    return offset, scale, float(np.sqrt(np.mean(residual**2)))


def _middle(samples: Floats) -> Floats:
    """A first guess: the middle of what was seen, level; the down axis is seen from one side only."""
    middle = (samples.max(axis=1) + samples.min(axis=1)) / 2.0
    return np.array([middle[0], middle[1], 0.0])
