"""`/api/v1/map`: the layers that the console draws over its coastline, and the map files of the tower.

A file is read by ranges (RFC 9110, 14), as PMTiles intends. Its content is compressed already and is sent as it is.
"""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated, Final, Literal

from fastapi import APIRouter
from fastapi.responses import FileResponse, Response
from pydantic import BaseModel, Field

from server.http.access import Viewer
from server.http.dependencies import SettingsDep
from server.http.problem_docs import answers
from server.kernel.access import BadToken, NotSignedIn, ScopeMissing, SessionExpired
from server.maps.api.dependencies import MapFolderDep, MapLayersDep, TerrainDep
from server.maps.api.tile_routes import CONFIGURED as CONFIGURED_LAYER
from server.maps.core import MapTileUnavailable
from server.maps.io.map_files import MapFile, MapRole
from server.maps.io.tile_source import NoTileFile, TileAddresses, TileFile, TileKind
from server.maps.store.layers import KnownLayer
from server.runtime.settings import Settings

router = APIRouter(
    prefix="/api/v1/map", tags=["map"], responses=answers(NotSignedIn, SessionExpired, BadToken, ScopeMissing)
)

FILES_PATH: Final = "/api/v1/map/files"
LAYERS_PATH: Final = "/api/v1/map/layers"
CONFIGURED: Final = "tiles"
"""The id of the layer of `TOWER_TILES`."""
CONFIGURED_PATH: Final = "/api/v1/map/tiles.pmtiles"
MEDIA_TYPE: Final = "application/vnd.pmtiles"
MAX_PLACES: Final = 2_000
_KEPT: Final = "private, max-age=604800, no-transform"
"""Cached by the browser only, for a week: the address that the console uses changes with the file."""
_FILE_ANSWERS: Final[dict[int | str, dict[str, object]]] = {
    200: {"content": {MEDIA_TYPE: {}}, "description": "The whole file"},
    206: {"content": {MEDIA_TYPE: {}}, "description": "The range that was asked for"},
    400: {"description": "The range cannot be read"},
    416: {"description": "The file has no such range"},
    **answers(NoTileFile),
}


class LayerView(BaseModel):
    id: str
    name: Annotated[str, Field(description="For people")]
    role: Annotated[
        MapRole,
        Field(description="`imagery`: from above; `map`: streets, land, names; `terrain`: heights in terrarium tiles"),
    ]
    kind: Literal["raster", "vector"]
    source: Annotated[
        Literal["file", "addresses"],
        Field(description="`file`: PMTiles, here; `addresses`: single raster tiles"),
    ]
    url: Annotated[str, Field(description="URL of the file, or URL template with {z}, {x} and {y}")]
    tile_size: Annotated[int, Field(description="Pixels along an edge of a raster tile")]
    max_zoom: Annotated[int | None, Field(description="For `addresses`; a file contains its own")]
    attribution: Annotated[str, Field(description="To show on the map; may be empty")]


class MapView(BaseModel):
    layers: list[LayerView]


LatLon = tuple[Annotated[float, Field(ge=-90, le=90)], Annotated[float, Field(ge=-180, le=180)]]


class PlacesBody(BaseModel):
    places: Annotated[list[LatLon], Field(max_length=MAX_PLACES, description="Latitude and longitude in degrees")]


class HeightsView(BaseModel):
    heights_m: Annotated[
        list[float | None], Field(description="Of the ground above the sea; null: this tower does not know it")
    ]


@router.post("/heights", responses=answers(MapTileUnavailable))
async def get_heights(principal: Viewer, body: PlacesBody, terrain: TerrainDep) -> HeightsView:
    """Returns the height of the ground at each place, from the elevation that this tower has."""
    try:
        return HeightsView(heights_m=await terrain.in_turn(lambda: terrain.heights(body.places)))
    except TimeoutError:
        raise MapTileUnavailable("the heights are not to be had now") from None


@router.get("")
async def get_map(principal: Viewer, settings: SettingsDep, folder: MapFolderDep, layers: MapLayersDep) -> MapView:
    """Returns the layers that the console may draw over its built-in coastline."""
    added = [_added(one) for one in await layers.all()]
    files, _ = await asyncio.to_thread(folder.look)
    configured = await asyncio.to_thread(_configured, settings)
    return MapView(layers=[*configured, *(_layer(file) for file in files), *added])


@router.head("/tiles.pmtiles", include_in_schema=False)
@router.get("/tiles.pmtiles", response_class=Response, responses=_FILE_ANSWERS)
async def get_tile_file(principal: Viewer, settings: SettingsDep) -> FileResponse:
    """Returns the file of the setting TOWER_TILES, whole or by ranges."""
    if not isinstance(settings.tiles, TileFile):
        raise NoTileFile
    return await _sent(settings.tiles.path)


@router.head("/files/{name}", include_in_schema=False)
@router.get("/files/{name}", response_class=Response, responses=_FILE_ANSWERS)
async def get_map_file(principal: Viewer, name: str, folder: MapFolderDep) -> FileResponse:
    """Returns a file of the folder of maps, whole or by ranges."""
    file = await asyncio.to_thread(folder.find, name)
    if file is None:
        raise NoTileFile
    return await _sent(file.path)


async def _sent(path: Path) -> FileResponse:
    try:
        found = await asyncio.to_thread(path.stat)
    except OSError:
        raise NoTileFile from None  # it existed a moment ago, or when the tower started
    return FileResponse(path, media_type=MEDIA_TYPE, headers={"Cache-Control": _KEPT}, stat_result=found)


def _layer(file: MapFile) -> LayerView:
    return LayerView(
        id=f"file-{file.name}",
        name=file.title,
        role=file.role,
        kind=file.kind,
        source="file",
        url=f"{FILES_PATH}/{file.name}?v={file.version}",
        tile_size=file.tile_size,
        max_zoom=None,
        attribution=file.attribution,
    )


def _added(known: KnownLayer) -> LayerView:
    about = known.about
    return LayerView(
        id=f"layer-{known.id}",
        name=about.name,
        role=about.role,
        kind="raster",
        source="addresses",
        url=f"{LAYERS_PATH}/{known.id}/{{z}}/{{x}}/{{y}}",
        tile_size=about.tile_size,
        max_zoom=about.max_zoom,
        attribution=about.attribution,
    )


def _configured(settings: Settings) -> list[LayerView]:
    """Returns the layer of `TOWER_TILES`, if it is set."""
    match settings.tiles:
        case TileAddresses():
            url = f"{LAYERS_PATH}/{CONFIGURED_LAYER}/{{z}}/{{x}}/{{y}}"
            return [_configured_layer(settings, "raster", "addresses", url, settings.tiles_most_zoom)]
        case TileFile(kind=kind) as file:
            return [_configured_layer(settings, kind, "file", f"{CONFIGURED_PATH}?v={_version(file)}", None)]
        case _:
            return []


def _configured_layer(
    settings: Settings,
    kind: TileKind,
    source: Literal["file", "addresses"],
    url: str,
    max_zoom: int | None,
) -> LayerView:
    return LayerView(
        id=CONFIGURED,
        name="Map of this tower",
        role="map",
        kind=kind,
        source=source,
        url=url,
        tile_size=256,
        max_zoom=max_zoom,
        attribution=settings.tiles_attribution,
    )


def _version(file: TileFile) -> str:
    """Changes whenever the file changes."""
    try:
        found = file.path.stat()
    except OSError:
        return "gone"
    return f"{found.st_mtime_ns:x}-{found.st_size:x}"
