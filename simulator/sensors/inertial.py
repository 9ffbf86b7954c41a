"""Accelerometers and gyroscopes: bias at switch-on, bias that wanders, noise, scale, vibration of the motors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from simulator.physics.rotation import Floats, limited


@dataclass(frozen=True, slots=True)
class InertialErrors:
    """Standard deviations of one kind of sensor, in its unit (m/s^2 or rad/s)."""

    bias: float
    """From one switch-on to the next."""
    bias_walk: float
    """Growth of the bias in the square root of a second."""
    noise: float
    """In the square root of a hertz."""
    vibration: float
    """Added to one sample of a hovering vehicle; grows with thrust."""
    scale: float
    """Share of the reading."""
    limit: float
    """Largest reading."""


ACCELEROMETER = InertialErrors(
    bias=0.06, bias_walk=0.0006, noise=0.003, vibration=0.15, scale=0.001, limit=16.0 * 9.80665
)
GYROSCOPE = InertialErrors(
    bias=math.radians(0.4),
    bias_walk=math.radians(0.002),
    noise=math.radians(0.005),
    vibration=math.radians(0.3),
    scale=0.001,
    limit=math.radians(2000.0),
)
"""Both as data sheets of sensors on present flight controllers give them, with the vibration that propellers add."""


class Inertial:
    """Three axes of one kind, read every step."""

    def __init__(self, errors: InertialErrors, count: int, random_source: np.random.Generator) -> None:
        self.errors = errors
        self._random = random_source
        self.bias = errors.bias * random_source.standard_normal((3, count))
        self._scale = 1.0 + errors.scale * random_source.standard_normal((3, count))
        self.noise_factor = np.ones(count)
        """Fault `imu_noise`: times the noise and vibration of a healthy sensor."""

        self.offset = np.zeros((3, count))
        """Fault: a bias that has appeared in flight."""
        self.stuck = np.zeros(count, dtype=np.bool_)
        """Fault: the last reading is repeated for ever."""
        self.silent = np.zeros(count, dtype=np.bool_)
        """Fault: what it says is no number."""
        self._last = np.zeros((3, count))

    def read(self, truth: Floats, load: Floats, dt_s: float) -> Floats:
        """`load`: thrust as a share of the weight."""
        errors = self.errors
        fresh = self._random.standard_normal((2, *truth.shape))
        self.bias += (errors.bias_walk * math.sqrt(dt_s)) * fresh[0]
        spread = np.sqrt(errors.noise**2 / (2.0 * dt_s) + (errors.vibration * load) ** 2) * self.noise_factor
        read = self._scale * truth + self.bias + spread * fresh[1]
        self._last = np.where(self.stuck, self._last, limited(read + self.offset, -errors.limit, errors.limit))
        return np.where(self.silent, np.nan, self._last)
