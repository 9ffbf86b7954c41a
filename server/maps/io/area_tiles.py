"""Which tiles cover an area, from zoom 0 to the finest one wanted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

MAX_AREA_TILES: Final = 50_000
USUAL_TILE_BYTES: Final = 25_000
"""For an estimate, while nothing of a layer is stored."""
_MAX_LAT_DEG: Final = 85.0


@dataclass(frozen=True, slots=True)
class Area:
    """Degrees; `west` may be greater than `east`: across the antimeridian."""

    south: float
    west: float
    north: float
    east: float


def count_tiles(area: Area, max_zoom: int) -> int:
    return sum(len(columns) * len(rows) for _, columns, rows in _blocks(area, max_zoom))


def area_tiles(area: Area, max_zoom: int) -> Iterator[tuple[int, int, int]]:
    """Yields zoom, x and y, coarse ones first: an unfinished area is a blurred map and not half a map."""
    for zoom, columns, rows in _blocks(area, max_zoom):
        for y in rows:
            for x in columns:
                yield zoom, x % (1 << zoom), y


def _blocks(area: Area, max_zoom: int) -> Iterator[tuple[int, range, range]]:
    east = area.east + 360.0 if area.west > area.east else area.east
    for zoom in range(max_zoom + 1):
        side = 1 << zoom
        left, right = (math.floor((lon + 180.0) / 360.0 * side) for lon in (area.west, east))
        top, bottom = (min(max(math.floor(_along(lat) * side), 0), side - 1) for lat in (area.north, area.south))
        yield zoom, range(left, min(right, left + side - 1) + 1), range(top, bottom + 1)


def _along(lat_deg: float) -> float:
    lat = math.radians(min(max(lat_deg, -_MAX_LAT_DEG), _MAX_LAT_DEG))
    return 0.5 - math.log(math.tan(math.pi / 4 + lat / 2)) / (2 * math.pi)
