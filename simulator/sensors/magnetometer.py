"""Magnetometers: iron and wiring of the vehicle displace and stretch the field, until a calibration takes that away."""

from __future__ import annotations

import math

import numpy as np

from simulator.physics.rotation import Floats, to_body
from simulator.sensors.magnetometer_calibration import MagnetometerCalibration
from simulator.sensors.sampling import Reading, Sampling

FIELD_GAUSS = 0.48
INCLINATION_DEG = 63.5
DECLINATION_DEG = 3.0
"""The earth's field in central Europe."""
HARD_IRON_GAUSS = 0.08
SOFT_IRON_SHARE = 0.03
NOISE_GAUSS = 0.004
RATE_HZ = 25.0


def earth_field_gauss() -> Floats:
    """Returns north, east, down, (3, 1)."""
    level = FIELD_GAUSS * math.cos(math.radians(INCLINATION_DEG))
    turn = math.radians(DECLINATION_DEG)
    down = FIELD_GAUSS * math.sin(math.radians(INCLINATION_DEG))
    return np.array([[level * math.cos(turn)], [level * math.sin(turn)], [down]])


class Magnetometer:
    def __init__(self, count: int, random_source: np.random.Generator) -> None:
        self._random = random_source
        self._sampling = Sampling(RATE_HZ, delay_s=0.01)
        self._field = earth_field_gauss()
        self.hard_iron_gauss = HARD_IRON_GAUSS * random_source.standard_normal((3, count))
        self.soft_iron = 1.0 + SOFT_IRON_SHARE * random_source.standard_normal((3, count))
        self.jump_gauss = np.zeros((3, count))
        """Fault `compass_jump`: a field that appears beside the sensor."""
        self.stuck = np.zeros(count, dtype=np.bool_)
        """Fault: the last reading is repeated for ever."""
        self._last = np.zeros((3, count))
        self.present = np.ones(count, dtype=np.bool_)
        self.calibration = MagnetometerCalibration.none(count)

    def step(self, rotation: Floats, now_s: float) -> Reading | None:
        """Returns the calibrated field in body axes, gauss."""
        if self._sampling.due(now_s):
            self._last = np.where(self.stuck, self._last, self.raw_gauss(rotation))
            self._sampling.put(Reading(now_s, self._last, self.present.copy()))
        arrived = self._sampling.take(now_s)
        if arrived is None:
            return None
        return Reading(arrived.taken_s, self.calibration.corrected(arrived.value), arrived.fresh)

    def raw_gauss(self, rotation: Floats) -> Floats:
        field = to_body(rotation, np.broadcast_to(self._field, (3, rotation.shape[2])))
        noise = NOISE_GAUSS * self._random.standard_normal(field.shape)
        return np.asarray(self.soft_iron * field + self.hard_iron_gauss + self.jump_gauss + noise)
