"""Assembles what serves maps and the height of the ground."""

from __future__ import annotations

from dataclasses import dataclass

from server.maps.io.elevation.uploads import ElevationUploads
from server.maps.io.elevation_layer import ElevationLayer
from server.maps.io.map_files import MapFolder
from server.maps.io.terrain import Terrain
from server.maps.io.tile_proxy import TileProxy
from server.maps.io.tile_store import TileStore
from server.maps.store.areas import MapAreas
from server.maps.store.layers import MapLayers
from server.runtime.settings import Settings
from server.storage.database import Database


@dataclass(frozen=True)
class MapParts:
    folder: MapFolder
    layers: MapLayers
    areas: MapAreas
    proxy: TileProxy
    terrain: Terrain
    elevation: ElevationUploads


def new_map_parts(settings: Settings, database: Database) -> MapParts:
    folder, layers = MapFolder(settings.maps), MapLayers(database)
    store = TileStore(settings.var / "tiles", settings.var / "offline-maps", settings.tile_cache_mb * 1_000_000)
    proxy = TileProxy(store)
    terrain = Terrain(
        lambda: folder.look()[0],
        lambda: [ElevationLayer(one.tiles, proxy) for one in layers.known if one.about.role == "terrain"],
    )
    elevation = ElevationUploads(settings.maps, settings.map_file_largest_mb * 1_000_000)
    return MapParts(folder, layers, MapAreas(database, layers, proxy), proxy, terrain, elevation)
