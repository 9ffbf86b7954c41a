"""The heights of the simulated land as image tiles in the terrarium encoding: metres above sea level + 32,768, as red *
256 + green + blue / 256.

One zoom is enough: the hills are wide, and between its points a reader interpolates to a few centimetres. The coarser
ones serve maps that are far out.
"""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from simulator.land_map.features import HALF_M
from simulator.land_map.pmtiles import TileType
from simulator.land_map.tile_grid import Bounds, Tile, TileGrid
from simulator.terrain import hills_m

Heights = npt.NDArray[np.float64]

TILE_PX: Final = 256
ZOOMS: Final = (10, 11, 12, 13, 14)
STEP_M: Final = 1 / 64
"""Finer steps only make the files larger."""
KIND: Final = TileType.PNG
METADATA: Final[dict[str, Any]] = {
    "name": "Heights of the simulated land",
    "type": "baselayer",
    "description": "The ground under the simulated drones",
    "attribution": "Simulated land",
    "tile_size": TILE_PX,
    "encoding": "terrarium",
}


def height_tiles(_seed: int, grid: TileGrid) -> dict[Tile, bytes]:
    """The hills are the same for every seed."""
    return {tile: encoded(heights(grid, tile)) for zoom in ZOOMS for tile in grid.covering(zoom, HALF_M)}


def heights(grid: TileGrid, tile: Tile) -> Heights:
    """Returns metres above the sea at the middles of a tile's pixels, from north to south and west to east."""
    parts = (np.arange(TILE_PX) + 0.5) / TILE_PX
    east_m = np.array([grid.corner_m(tile, float(part), 0.0)[0] for part in parts])
    north_m = np.array([grid.corner_m(tile, 0.0, float(part))[1] for part in parts])
    return np.asarray(grid.home_alt_m + hills_m(north_m[:, None], east_m[None, :], np))


def encoded(heights_m: Heights) -> bytes:
    steps = np.round((heights_m + 32_768.0) / STEP_M).astype(np.int64) * round(STEP_M * 256)
    picture = np.stack([steps & 0xFF, (steps >> 8) & 0xFF, steps >> 16], axis=-1).astype(np.uint8)  # blue, green, red
    _, written = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    return written.tobytes()


def bounds(grid: TileGrid) -> Bounds:
    return grid.bounds(HALF_M)
