"""The simulated land from above, as image tiles: the picture that the cameras' ground is cut from, with every tree.

The nearer to home, the finer. The land has no end: each zoom covers a square of its own, and where a finer tile is
missing the console stretches a coarser one.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from simulator.camera.ground_map import SIZE_PX, TEXEL_M, draw_crown, ground_map
from simulator.land_map.features import HALF_M
from simulator.land_map.pmtiles import TileType
from simulator.land_map.tile_grid import Bounds, Tile, TileGrid

Picture = npt.NDArray[np.uint8]

TILE_PX: Final = 512
TILES_PER_SIDE: Final = {12: 2, 13: 4, 14: 6, 15: 10, 16: 12, 17: 12, 18: 12}
"""All of `HALF_M` up to zoom 15. At zoom 18 a pixel is 0.2 m at 47 degrees of latitude, over 1.2 km around home."""
QUALITY: Final = 68
THREADS: Final = 2
KIND: Final = TileType.JPEG
METADATA: Final[dict[str, Any]] = {
    "name": "Simulated land from above",
    "type": "baselayer",
    "description": "The land under the simulated drones, as their cameras see it",
    "attribution": "Simulated land",
    "tile_size": TILE_PX,
}


def image_tiles(seed: int, grid: TileGrid) -> dict[Tile, bytes]:
    """Takes about four seconds, and 130 MB meanwhile."""
    levels = _levels(seed)
    wanted = [tile for zoom, per_side in TILES_PER_SIDE.items() for tile in grid.around_home(zoom, per_side)]
    with ThreadPoolExecutor(THREADS) as pool:
        return dict(zip(wanted, pool.map(lambda tile: _encoded(levels, grid, tile), wanted), strict=True))


def _levels(seed: int) -> list[Picture]:
    """Each has half the resolution of the one before. The cameras draw most trees standing, so their ground lacks
    them."""
    ground = ground_map(seed)
    finest = ground.levels[0].copy()
    for tree in ground.land.trees:
        if not tree.in_wood:
            draw_crown(finest, tree, TEXEL_M)
    levels = [finest]
    while levels[-1].shape[0] > 64:
        half = levels[-1].shape[0] // 2
        levels.append(np.asarray(cv2.resize(levels[-1], (half, half), interpolation=cv2.INTER_AREA), np.uint8))
    return levels


def _encoded(levels: list[Picture], grid: TileGrid, tile: Tile) -> bytes:
    west, north = grid.corner_m(tile, 0.0, 0.0)
    east, south = grid.corner_m(tile, 1.0, 1.0)
    texel_m = (east - west) / TILE_PX
    level = min(max(round(np.log2(texel_m / TEXEL_M)), 0), len(levels) - 1)
    scale = TEXEL_M * 2**level
    middle = SIZE_PX / 2**level / 2
    # Over one tile Mercator is straight to a few centimetres. Pixels count from their centres.
    across, along = (east - west) / TILE_PX / scale, (north - south) / TILE_PX / scale
    move = np.array(
        [
            [across, 0.0, west / scale + middle + 0.5 * across - 0.5],
            [0.0, along, middle - north / scale + 0.5 * along - 0.5],
        ]
    )
    # Kept near the origin: the warp counts pixels in 16 bits.
    side = levels[level].shape[0]
    move[:, 2] %= side
    drawn = cv2.warpAffine(
        levels[level],
        move,
        (TILE_PX, TILE_PX),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_WRAP,
    )
    _, encoded = cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return encoded.tobytes()


def bounds(grid: TileGrid) -> Bounds:
    return grid.bounds(HALF_M)
