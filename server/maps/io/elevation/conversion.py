"""Makes a PMTiles file of terrarium tiles from a GeoTIFF.

The finest zoom is the first whose pixels are no larger than those of the GeoTIFF: nothing that rises between them is
lost. Coarser zooms are means, for maps that are far out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from server.maps.io.elevation.converted import Converted
from server.maps.io.elevation.georeference import Georeference, georeference_of
from server.maps.io.elevation.height_grid import EDGE_PX, HeightGrid, unpack_heights
from server.maps.io.elevation.pmtiles_writer import Bounds, PmtilesWriter
from server.maps.io.elevation.projections import EQUATOR_M, Array, Geographic, WebMercator
from server.maps.io.elevation.refusals import BadElevationFile
from server.maps.io.elevation.terrarium_writer import encoded
from server.maps.io.elevation.tiff_file import TiffFile

TILE_PX: Final = 256
MAX_TILES: Final = 20_000
"""Of the finest zoom: about 2 GB."""
MAX_ZOOM: Final = 18
COARSER_ZOOMS: Final = 6
MAX_LAT_DEG: Final = 85.05
_EDGE_POINTS: Final = 65
_ZOOM_TOLERANCE: Final = 0.05
"""Of a zoom: pixels that are 3 % larger than those of the file lose nothing."""
_UNPACKING: Final = 0.2
"""Share of the time, about."""


def convert(
    source: Path,
    target: Path,
    scratch: Path,
    *,
    title: str,
    attribution: str,
    max_bytes: int,
    report: Callable[[float], None],
) -> Converted:
    """Writes `target` and, while it works, `scratch`. `report` gets the share that is done, 0 to 1. Raises OSError and
    BadElevationFile."""
    with TiffFile(source) as file:
        reference = georeference_of(file)
        pyramid = _pyramid(file.width, file.height, reference)
        grid = unpack_heights(file, reference, scratch, lambda share: report(share * _UNPACKING))
    with target.open("xb") as out:
        writer = PmtilesWriter(out)
        _Build(grid, pyramid, writer, max_bytes, report).tile(0, 0, 0)
        if writer.tiles == 0:
            raise BadElevationFile("has no height anywhere")
        writer.finish(
            pyramid.bounds,
            {
                "name": title,
                "type": "baselayer",
                "description": "Heights of the ground, from a GeoTIFF",
                "attribution": attribution,
                "tile_size": TILE_PX,
                "encoding": "terrarium",
            },
        )
        return Converted(zoom=pyramid.zoom, tiles=writer.tiles, bytes=out.seek(0, 2))


@dataclass(frozen=True)
class _Pyramid:
    """`left` and the others: edges of the area in shares of the world, from west to east and from north to south.
    `right` may be beyond 1: across the antimeridian."""

    zoom: int
    left: float
    top: float
    right: float
    bottom: float
    bounds: Bounds
    count: int

    def covers(self, zoom: int, x: int, y: int) -> bool:
        side = 1 << zoom
        if not (y / side < self.bottom and (y + 1) / side > self.top):
            return False
        return any(x / side + turn < self.right and (x + 1) / side + turn > self.left for turn in (-1, 0, 1))


def _pyramid(width: int, height: int, reference: Georeference) -> _Pyramid:
    columns, rows = (np.linspace(-EDGE_PX, size - 1 + EDGE_PX, _EDGE_POINTS) for size in (width, height))
    x, y = reference.x + columns * reference.step_x, reference.y - rows * reference.step_y
    # Along all four edges: those of a UTM zone are bent.
    lat_deg, lon_deg = reference.projection.back(
        np.concatenate([x, x, np.full_like(y, x[0]), np.full_like(y, x[-1])]),
        np.concatenate([np.full_like(x, y[0]), np.full_like(x, y[-1]), y, y]),
    )
    if not (np.isfinite(lat_deg).all() and np.isfinite(lon_deg).all()) or np.abs(lat_deg).max() > 91.0:
        raise BadElevationFile("lies nowhere on Earth: its georeference is wrong")
    south, north = (float(np.clip(one, -MAX_LAT_DEG, MAX_LAT_DEG)) for one in (lat_deg.min(), lat_deg.max()))
    west, east = float(lon_deg.min()), float(lon_deg.max())
    if south >= north:
        raise BadElevationFile("lies beyond 85 degrees of latitude, where the map ends")
    if west < -540.0 or east > 540.0:
        raise BadElevationFile("lies nowhere on Earth: its georeference is wrong")
    nearest_lat = math.radians(min(max(0.0, south), north))
    shrink = math.cos(nearest_lat)
    unit_m = reference.projection.metres_per_unit
    if isinstance(reference.projection, Geographic):
        step_m = min(reference.step_x * shrink, reference.step_y) * unit_m
    else:
        true = shrink if isinstance(reference.projection, WebMercator) else 1.0
        step_m = min(reference.step_x, reference.step_y) * unit_m * true
    pixels = 2 * math.pi * EQUATOR_M * shrink / (step_m * TILE_PX)
    zoom = min(max(math.ceil(math.log2(pixels) - _ZOOM_TOLERANCE), 0), MAX_ZOOM)
    left, right = (west + 180.0) / 360.0, (east + 180.0) / 360.0
    top, bottom = (_along(lat) for lat in (north, south))
    side = 1 << zoom
    count = (math.floor(right * side) - math.floor(left * side) + 1) * (
        math.floor(bottom * side) - math.floor(top * side) + 1
    )
    if count > MAX_TILES:
        raise BadElevationFile(
            f"is too large: {count:,} tiles of zoom {zoom}, at most {MAX_TILES:,}. Cut it into parts (gdal_translate "
            "-projwin) or make it coarser (-tr)"
        )
    turn = 360.0 if west < -180.0 else 0.0
    bounds = Bounds(max(west + turn, -180.0), south, min(east + turn, 180.0), north)
    return _Pyramid(zoom, left, top, right, bottom, bounds, count)


def _along(lat_deg: float) -> float:
    return 0.5 - math.log(math.tan(math.pi / 4 + math.radians(lat_deg) / 2)) / (2 * math.pi)


@dataclass
class _Build:
    """Depth first: of the finer tiles only the four of one coarser tile are in memory."""

    grid: HeightGrid
    pyramid: _Pyramid
    writer: PmtilesWriter
    max_bytes: int
    report: Callable[[float], None]
    done: int = 0

    def tile(self, zoom: int, x: int, y: int) -> Array | None:
        """Writes the tile and all finer ones in it, and returns its heights."""
        if not self.pyramid.covers(zoom, x, y):
            return None
        is_finest = zoom == self.pyramid.zoom
        heights_m = self._finest(x, y) if is_finest else self._coarser(zoom, x, y)
        if heights_m is not None and zoom >= self.pyramid.zoom - COARSER_ZOOMS:
            self.writer.add(zoom, x, y, encoded(heights_m))
            if self.writer.size_bytes > self.max_bytes:
                raise BadElevationFile(f"is too large: its tiles have more than {self.max_bytes // 1_000_000} MB")
        if is_finest:
            self.done += 1
            self.report(_UNPACKING + (1 - _UNPACKING) * min(self.done / self.pyramid.count, 1.0))
        return heights_m

    def _finest(self, x: int, y: int) -> Array | None:
        side = 1 << self.pyramid.zoom
        middles = (np.arange(TILE_PX) + 0.5) / TILE_PX
        lon_deg = (x + middles) / side * 360.0 - 180.0
        lat_deg = np.degrees(np.arctan(np.sinh(math.pi * (1 - 2 * (y + middles) / side))))
        return self.grid.at(lat_deg[:, None], lon_deg[None, :])

    def _coarser(self, zoom: int, x: int, y: int) -> Array | None:
        whole = np.full((2 * TILE_PX, 2 * TILE_PX), np.nan)
        is_known = False
        for down in (0, 1):
            for right in (0, 1):
                part = self.tile(zoom + 1, 2 * x + right, 2 * y + down)
                if part is not None:
                    is_known = True
                    whole[down * TILE_PX :, right * TILE_PX :][:TILE_PX, :TILE_PX] = part
        if not is_known:
            return None
        fours = whole.reshape(TILE_PX, 2, TILE_PX, 2)
        known = ~np.isnan(fours)
        count = known.sum(axis=(1, 3))
        total = np.where(known, fours, 0.0).sum(axis=(1, 3))
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)
