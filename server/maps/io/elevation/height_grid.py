"""The heights of a GeoTIFF, unpacked into a file of their own, and read bilinearly at any places."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from server.maps.io.elevation.georeference import Georeference
from server.maps.io.elevation.projections import Array, Geographic
from server.maps.io.elevation.refusals import BadElevationFile
from server.maps.io.elevation.tiff_file import TiffFile

LOWEST_M: Final = -12_000.0
HIGHEST_M: Final = 9_000.0
"""No ground is beyond them: such values mean "unknown", also where the file does not say so."""
EDGE_PX: Final = 1.5
"""So far beyond the middles of the last pixels their heights go on: half a pixel is theirs, and one is what a reader
needs to interpolate at the edge. So files that lie side by side leave no gap."""
_NODATA: Final = 42113


class HeightGrid:
    def __init__(self, heights_m: npt.NDArray[np.float32], reference: Georeference) -> None:
        self._heights_m, self.reference = heights_m, reference
        self.height, self.width = heights_m.shape

    def at(self, lat_deg: Array, lon_deg: Array) -> Array | None:
        """Returns metres above the sea, NaN where they are not known; None if none is known. The arrays are broadcast
        against each other."""
        reference = self.reference
        x, y = reference.projection.forward(lat_deg, lon_deg)
        if isinstance(reference.projection, Geographic):
            west = reference.x - EDGE_PX * reference.step_x
            x = west + (x - west) % 360.0
        column, row = (x - reference.x) / reference.step_x, (reference.y - y) / reference.step_y
        inside = _is_near(column, self.width) & _is_near(row, self.height)
        if not inside.any():
            return None
        left, share_x = _split(column, self.width)
        top, share_y = _split(row, self.height)
        first_row, first_column = int(top.min()), int(left.min())
        part = np.asarray(
            self._heights_m[first_row : int(top.max()) + 2, first_column : int(left.max()) + 2], np.float64
        )
        top, left = top - first_row, left - first_column
        upper = part[top, left] * (1 - share_x) + part[top, left + 1] * share_x
        lower = part[top + 1, left] * (1 - share_x) + part[top + 1, left + 1] * share_x
        heights_m = np.where(inside, upper * (1 - share_y) + lower * share_y, np.nan)
        return None if np.isnan(heights_m).all() else heights_m


def _is_near(at: Array, size: int) -> npt.NDArray[np.bool_]:
    return (at >= -EDGE_PX) & (at <= size - 1 + EDGE_PX)


def _split(at: Array, size: int) -> tuple[npt.NDArray[np.int64], Array]:
    inner = np.clip(at, 0.0, size - 1.0)
    first = np.minimum(np.floor(inner), size - 2).astype(np.int64)
    return first, inner - first


def unpack_heights(
    file: TiffFile, reference: Georeference, scratch: Path, report: Callable[[float], None]
) -> HeightGrid:
    """Writes `scratch`, 4 bytes a pixel. Reports the share that is done. Raises OSError and BadElevationFile."""
    heights_m = np.memmap(scratch, np.float32, "w+", shape=(file.height, file.width))
    nodata = _nodata(file)
    for number, (row, column, values) in enumerate(file.blocks(), 1):
        if values is None:
            heights_m[row : row + file.block_height, column : column + file.block_width] = np.nan
            continue
        block = values.astype(np.float64)
        if nodata is not None:
            # Compared as the file has it: 32-bit floats round what the text says.
            block[values == np.asarray(nodata).astype(values.dtype)] = np.nan
        block *= reference.height_unit_m
        with np.errstate(invalid="ignore"):
            block[~((block >= LOWEST_M) & (block <= HIGHEST_M))] = np.nan
        heights_m[row : row + block.shape[0], column : column + block.shape[1]] = block
        report(number / file.block_count)
    return HeightGrid(heights_m, reference)


def _nodata(file: TiffFile) -> float | None:
    said = file.text(_NODATA).strip()
    if not said:
        return None
    try:
        nodata = float(said)
    except ValueError:
        raise BadElevationFile(f"says that {said[:20]!r} means no value, which is no number") from None
    if file.dtype.kind == "f":
        return nodata
    limits = np.iinfo(file.dtype.name)
    return nodata if nodata.is_integer() and limits.min <= nodata <= limits.max else None
