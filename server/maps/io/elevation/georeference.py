"""Where the pixels of a GeoTIFF lie, and in which unit its heights are. OGC GeoTIFF standard 1.1 (19-008r4)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from server.maps.io.elevation.projections import Geographic, Projection, Utm, WebMercator
from server.maps.io.elevation.refusals import BadElevationFile
from server.maps.io.elevation.tiff_file import TiffFile

_SCALE, _TIE_POINTS, _MATRIX, _KEYS = 33550, 33922, 34264, 34735
_MODEL, _RASTER, _GEOGRAPHIC, _PROJECTED, _HEIGHT_UNIT = 1024, 1025, 2048, 3072, 4099
_PIXEL_IS_POINT: Final = 2
_GEOGRAPHIC_CODES: Final = frozenset({4326, 4979, 4258, 4269, 4283, 7844, 4674, 4167})
"""WGS 84, and what lies within two metres of it: ETRS89, NAD83, GDA94, GDA2020, SIRGAS 2000, NZGD2000."""
_UNIT_M: Final = {0: 1.0, 9001: 1.0, 9002: 0.3048, 9003: 1200 / 3937}


@dataclass(frozen=True)
class Georeference:
    """`x`, `y`: the middle of the first pixel (north-west), in the plane of the projection. Steps are positive."""

    projection: Projection
    x: float
    y: float
    step_x: float
    step_y: float
    height_unit_m: float


def georeference_of(file: TiffFile) -> Georeference:
    """Raises BadElevationFile."""
    keys = _keys(file)
    x, y, step_x, step_y = _affine(file)
    if not (all(math.isfinite(one) for one in (x, y, step_x, step_y)) and step_x > 0 and step_y > 0):
        raise BadElevationFile("is turned or mirrored: north must be up (gdalwarp)")
    if keys.get(_RASTER) != _PIXEL_IS_POINT:
        x, y = x + step_x / 2, y - step_y / 2
    unit_m = _UNIT_M.get(keys.get(_HEIGHT_UNIT, 0))
    if unit_m is None:
        raise BadElevationFile("has heights in a unit that is not known: metres and feet are")
    return Georeference(_projection(keys), x, y, step_x, step_y, unit_m)


def _keys(file: TiffFile) -> dict[int, int]:
    """Only those whose value is in the directory itself: codes, no names and parameters."""
    words = [int(one) for one in file.numbers(_KEYS)]
    rows = [words[at : at + 4] for at in range(4, len(words) - 3, 4)]
    return {key: value for key, place, _, value in rows if place == 0}


def _affine(file: TiffFile) -> tuple[float, float, float, float]:
    """Returns x, y of the first pixel's corner (or middle, if pixels are points), and the steps."""
    scale, ties, matrix = (file.numbers(tag) for tag in (_SCALE, _TIE_POINTS, _MATRIX))
    if len(scale) >= 2 and len(ties) >= 6:
        column, row, _, x, y = ties[:5]
        return x - column * scale[0], y + row * scale[1], scale[0], scale[1]
    if len(matrix) == 16:
        if matrix[1] or matrix[4]:
            raise BadElevationFile("is turned or mirrored: north must be up (gdalwarp)")
        return matrix[3], matrix[7], matrix[0], -matrix[5]
    raise BadElevationFile("has no georeference: it is no GeoTIFF, or its place stands in another file")


def _projection(keys: dict[int, int]) -> Projection:
    code = keys.get(_PROJECTED, 0)
    if keys.get(_MODEL) == 2 or not code:
        code = keys.get(_GEOGRAPHIC, 0)
        if code in _GEOGRAPHIC_CODES:
            return Geographic()
    if code == 3857:
        return WebMercator()
    family, zone = divmod(code, 100)
    # WGS 84 north and south, ETRS89, NAD83.
    if (
        (family in (326, 327) and 1 <= zone <= 60)
        or (family == 258 and 28 <= zone <= 38)
        or (family == 269 and 1 <= zone <= 23)
    ):
        return Utm(zone, is_south=family == 327)
    name = f"EPSG:{code}" if code not in (0, 32767) else "its own"
    raise BadElevationFile(
        f"has the projection {name}: only EPSG:4326, EPSG:3857 and UTM are read (gdalwarp -t_srs EPSG:4326)"
    )
