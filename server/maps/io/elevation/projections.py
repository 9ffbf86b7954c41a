"""From degrees to the plane of a map and back, for whole arrays: geographic, Web Mercator and UTM.

UTM by Krüger's series in the third flattening to the fourth order: within a millimetre in and beside a zone.
C. F. F. Karney, Transverse Mercator with an accuracy of a few nanometers, 2011.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

EQUATOR_M: Final = 6_378_137.0
_FLATTENING: Final = 1 / 298.257223563
_N: Final = _FLATTENING / (2 - _FLATTENING)
_ECCENTRICITY: Final = 2 * np.sqrt(_N) / (1 + _N)
_RADIUS_M: Final = EQUATOR_M / (1 + _N) * (1 + _N**2 / 4 + _N**4 / 64)
_FORWARD: Final = (
    _N / 2 - 2 * _N**2 / 3 + 5 * _N**3 / 16 + 41 * _N**4 / 180,
    13 * _N**2 / 48 - 3 * _N**3 / 5 + 557 * _N**4 / 1440,
    61 * _N**3 / 240 - 103 * _N**4 / 140,
    49561 * _N**4 / 161280,
)
_BACK: Final = (
    _N / 2 - 2 * _N**2 / 3 + 37 * _N**3 / 96 - _N**4 / 360,
    _N**2 / 48 + _N**3 / 15 - 437 * _N**4 / 1440,
    17 * _N**3 / 480 - 37 * _N**4 / 840,
    4397 * _N**4 / 161280,
)
_SCALE: Final = 0.9996
_FALSE_EAST_M: Final = 500_000.0
_FALSE_NORTH_M: Final = 10_000_000.0


class Projection(Protocol):
    @property
    def metres_per_unit(self) -> float:
        """Of the plane, from south to north on the ground at the equator."""
        ...

    def forward(self, lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
        """Returns x (to the east) and y (to the north)."""
        ...

    def back(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Returns latitude and longitude, degrees."""
        ...


class Geographic:
    metres_per_unit = EQUATOR_M * np.pi / 180

    def forward(self, lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
        return lon_deg, lat_deg

    def back(self, x: Array, y: Array) -> tuple[Array, Array]:
        return y, x


class WebMercator:
    metres_per_unit = 1.0

    def forward(self, lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
        return np.radians(lon_deg) * EQUATOR_M, np.arctanh(np.sin(np.radians(lat_deg))) * EQUATOR_M

    def back(self, x: Array, y: Array) -> tuple[Array, Array]:
        return np.degrees(np.arcsin(np.tanh(y / EQUATOR_M))), np.degrees(x / EQUATOR_M)


@dataclass(frozen=True)
class Utm:
    """`zone`: 1 to 60."""

    zone: int
    is_south: bool

    metres_per_unit = 1.0

    def forward(self, lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
        sine = np.sin(np.radians(lat_deg))
        away = np.radians((lon_deg - self._middle_deg + 180.0) % 360.0 - 180.0)
        t = np.sinh(np.arctanh(sine) - _ECCENTRICITY * np.arctanh(_ECCENTRICITY * sine))
        xi, eta = np.arctan2(t, np.cos(away)), np.arcsinh(np.sin(away) / np.hypot(t, np.cos(away)))
        along, across = xi, eta
        for order, part in enumerate(_FORWARD, 1):
            along = along + part * np.sin(2 * order * xi) * np.cosh(2 * order * eta)
            across = across + part * np.cos(2 * order * xi) * np.sinh(2 * order * eta)
        return _FALSE_EAST_M + _SCALE * _RADIUS_M * across, self._false_north_m + _SCALE * _RADIUS_M * along

    def back(self, x: Array, y: Array) -> tuple[Array, Array]:
        along, across = (y - self._false_north_m) / (_SCALE * _RADIUS_M), (x - _FALSE_EAST_M) / (_SCALE * _RADIUS_M)
        xi, eta = along, across
        for order, part in enumerate(_BACK, 1):
            xi = xi - part * np.sin(2 * order * along) * np.cosh(2 * order * across)
            eta = eta - part * np.cos(2 * order * along) * np.sinh(2 * order * across)
        # From the conformal latitude to the geographic one: the series converges by 150 times a step.
        conformal = np.arctanh(np.sin(xi) / np.cosh(eta))
        sine = np.tanh(conformal)
        for _ in range(5):
            sine = np.tanh(conformal + _ECCENTRICITY * np.arctanh(_ECCENTRICITY * sine))
        lon_deg = self._middle_deg + np.degrees(np.arctan2(np.sinh(eta), np.cos(xi)))
        return np.degrees(np.arcsin(sine)), lon_deg

    @property
    def _middle_deg(self) -> float:
        return self.zone * 6.0 - 183.0

    @property
    def _false_north_m(self) -> float:
        return _FALSE_NORTH_M if self.is_south else 0.0
