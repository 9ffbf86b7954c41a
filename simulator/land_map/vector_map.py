"""The vector map of the simulated land: its features cut into tiles, with the layer names of the Protomaps schema."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from simulator.camera.land import make_land
from simulator.land_map.features import HALF_M, Feature, features
from simulator.land_map.pmtiles import TileType
from simulator.land_map.tile_grid import Bounds, Tile, TileGrid
from simulator.land_map.vector_tile import EXTENT, Shape, TileFeature, encode_tile

MIN_ZOOM: Final = 8
MAX_ZOOM: Final = 14
"""Beyond it the console stretches: a unit is 0.2 m."""
LAYERS: Final = ("earth", "landcover", "landuse", "buildings", "roads", "pois", "places")
BUFFER: Final = 0.01
"""A tile also has what lies this share of its side outside: lines are wider than their middle."""
KIND: Final = TileType.MVT
METADATA: Final[dict[str, Any]] = {
    "name": "Simulated land",
    "type": "baselayer",
    "description": "The land under the simulated drones",
    "attribution": "Simulated land",
    "vector_layers": [{"id": name, "fields": {"kind": "String", "name": "String"}} for name in LAYERS],
}


def vector_tiles(seed: int, grid: TileGrid) -> dict[Tile, bytes]:
    """Takes about two seconds."""
    tiles: dict[Tile, dict[str, list[TileFeature]]] = {
        tile: {name: [] for name in LAYERS}
        for zoom in range(MIN_ZOOM, MAX_ZOOM + 1)
        for tile in grid.covering(zoom, HALF_M)
    }
    for feature in features(make_land(seed), seed):
        x, y = grid.to_world(feature.points_m[:, 0], feature.points_m[:, 1])
        world = np.column_stack([x, y])
        for zoom in range(max(feature.from_zoom, MIN_ZOOM), MAX_ZOOM + 1):
            for tile, placed in _placed(feature, world, zoom):
                if tile in tiles:
                    tiles[tile][feature.layer].append(placed)
    return {tile: encode_tile(layers.items()) for tile, layers in tiles.items()}


def _placed(feature: Feature, world: np.ndarray[Any, Any], zoom: int) -> list[tuple[Tile, TileFeature]]:
    """Returns the feature in each tile that it touches; a point in one only, so that its name appears once."""
    at = world * 2**zoom
    buffer = 0.0 if feature.shape is Shape.POINT else BUFFER
    (left, top), (right, bottom) = at.min(axis=0) - buffer, at.max(axis=0) + buffer
    found = []
    for x in range(int(left), int(right) + 1):
        for y in range(int(top), int(bottom) + 1):
            points = np.rint((at - (x, y)) * EXTENT).astype(np.int64)
            if feature.layer in ("earth", "landcover"):  # the only ones larger than a tile
                points = points.clip(-EXTENT // 8, EXTENT + EXTENT // 8)
            found.append((Tile(zoom, x, y), TileFeature(feature.shape, points, feature.facts)))
    return found


def bounds(grid: TileGrid) -> Bounds:
    return grid.bounds(HALF_M)
