"""Assembles what serves maps and the height of the ground."""

from __future__ import annotations

from dataclasses import dataclass

from server.runtime.elevation.uploads import ElevationUploads
from server.runtime.map_files import MapFolder
from server.runtime.maps.elevation_layer import ElevationLayer
from server.runtime.maps.terrain import Terrain
from server.runtime.maps.tile_proxy import TileProxy
from server.runtime.maps.tile_store import TileStore
from server.runtime.settings import Settings
from server.store.database import Database
from server.store.maps.areas import MapAreas
from server.store.maps.layers import MapLayers


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
