"""Web Mercator tiles over the simulated land: where a tile lies in metres from home, and which tiles cover a square."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simulator.geodesy import METRES_PER_E7, LocalFrame

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Tile:
    """Its zoom, column and row."""

    zoom: int
    x: int
    y: int


@dataclass(frozen=True, slots=True)
class Bounds:
    west_deg: float
    south_deg: float
    east_deg: float
    north_deg: float


class TileGrid:
    """The tiles around a home. Positions in metres are east and north of it."""

    def __init__(self, frame: LocalFrame) -> None:
        self._home = frame.origin
        # ArduPilot's flat earth, as the vehicles and their cameras use it.
        self._lat_per_m = 1e-7 / METRES_PER_E7
        self._lon_per_m = self._lat_per_m / math.cos(math.radians(frame.origin.lat_deg))

    @property
    def home_alt_m(self) -> float:
        """Above the sea."""
        return self._home.alt_amsl_m

    def to_world(self, east_m: Floats, north_m: Floats) -> tuple[Floats, Floats]:
        """Returns Web Mercator, 0 to 1 from west to east and from north to south."""
        lon = self._home.lon_deg + east_m * self._lon_per_m
        lat = np.radians(self._home.lat_deg + north_m * self._lat_per_m)
        return (lon + 180.0) / 360.0, 0.5 - np.log(np.tan(np.pi / 4 + lat / 2)) / (2 * np.pi)

    def corner_m(self, tile: Tile, across: float, along: float) -> tuple[float, float]:
        """Returns east and north of a point in a tile: 0, 0 is its north-western corner, 1, 1 the opposite one."""
        scale = 2.0**-tile.zoom
        lon = (tile.x + across) * scale * 360.0 - 180.0
        lat = math.degrees(2.0 * math.atan(math.exp(math.pi * (1.0 - 2.0 * (tile.y + along) * scale))) - math.pi / 2)
        return (lon - self._home.lon_deg) / self._lon_per_m, (lat - self._home.lat_deg) / self._lat_per_m

    def around_home(self, zoom: int, per_side: int) -> list[Tile]:
        """Returns the square of tiles whose middle is nearest to home; an even number per side."""
        x, y = self.to_world(np.array(0.0), np.array(0.0))
        side = 2**zoom
        left, top = round(float(x) * side) - per_side // 2, round(float(y) * side) - per_side // 2
        return [
            Tile(zoom, (left + i) % side, top + j)
            for j in range(per_side)
            for i in range(per_side)
            if 0 <= top + j < side
        ]

    def covering(self, zoom: int, half_m: float) -> list[Tile]:
        """Returns the tiles that a square around home touches."""
        x, y = self.to_world(np.array([-half_m, half_m]), np.array([half_m, -half_m]))
        side = 2**zoom
        columns = range(math.floor(x[0] * side), math.floor(x[1] * side) + 1)
        rows = range(max(math.floor(y[0] * side), 0), min(math.floor(y[1] * side), side - 1) + 1)
        return [Tile(zoom, column % side, row) for row in rows for column in columns]

    def bounds(self, half_m: float) -> Bounds:
        lat, lon = half_m * self._lat_per_m, half_m * self._lon_per_m
        home = self._home
        return Bounds(home.lon_deg - lon, home.lat_deg - lat, home.lon_deg + lon, home.lat_deg + lat)
