"""The services of maps, as routes take them."""

from typing import Annotated

from server.http.dependencies import provided
from server.maps.io.elevation.uploads import ElevationUploads
from server.maps.io.map_files import MapFolder
from server.maps.io.terrain import Terrain
from server.maps.io.tile_proxy import TileProxy
from server.maps.store.areas import MapAreas
from server.maps.store.layers import MapLayers

ElevationUploadsDep = Annotated[ElevationUploads, provided(ElevationUploads)]
MapAreasDep = Annotated[MapAreas, provided(MapAreas)]
MapFolderDep = Annotated[MapFolder, provided(MapFolder)]
MapLayersDep = Annotated[MapLayers, provided(MapLayers)]
TerrainDep = Annotated[Terrain, provided(Terrain)]
TileProxyDep = Annotated[TileProxy, provided(TileProxy)]
