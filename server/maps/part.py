"""Maps and the height of the ground."""

from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager
from typing import Final

from server.http.part import Common, Part, Services
from server.maps.api import admin_routes, elevation_routes, routes, tile_routes
from server.maps.io.elevation.uploads import ElevationUploads
from server.maps.io.elevation_layer import ElevationLayer
from server.maps.io.map_files import MapFolder
from server.maps.io.terrain import Terrain
from server.maps.io.tile_proxy import TileProxy
from server.maps.io.tile_store import TileStore
from server.maps.store.areas import MapAreas
from server.maps.store.layers import MapLayers
from server.runtime.background import in_background


def _services(common: Common) -> Iterable[object]:
    settings = common.settings
    folder, layers = MapFolder(settings.maps), MapLayers(common.database)
    store = TileStore(settings.var / "tiles", settings.var / "offline-maps", settings.tile_cache_mb * 1_000_000)
    proxy = TileProxy(store)
    terrain = Terrain(
        lambda: folder.look()[0],
        lambda: [ElevationLayer(one.tiles, proxy) for one in layers.known if one.about.role == "terrain"],
    )
    uploads = ElevationUploads(settings.maps, settings.map_file_largest_mb * 1_000_000)
    return folder, layers, MapAreas(common.database, layers, proxy), proxy, terrain, uploads


@asynccontextmanager
async def _running(_common: Common, services: Services) -> AsyncIterator[None]:
    try:
        async with in_background("offline maps", services.of(MapAreas).run):
            yield
    finally:
        await services.of(ElevationUploads).close()
        services.of(Terrain).close()
        services.of(TileProxy).close()


PART: Final = Part(
    routers=(routes.router, admin_routes.router, elevation_routes.router, tile_routes.router),
    tags={"map": "The tiles of the map."},
    services=_services,
    running=_running,
)
