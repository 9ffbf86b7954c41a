"""`/api/v1/map`: which tiles the console draws, and the tile file if the tower has one.

The file is read by ranges (RFC 9110, 14), as PMTiles intends. Its content is compressed already and is sent as it is.
"""

from __future__ import annotations

import asyncio
from typing import Annotated, Final, Literal

from fastapi import APIRouter
from fastapi.responses import FileResponse, Response
from pydantic import BaseModel, Field

from server.api.access import Viewer
from server.api.dependencies import SettingsDep
from server.api.http.problem_docs import answers
from server.domain.access import BadToken, NotSignedIn, ScopeMissing, SessionExpired
from server.runtime.tile_source import NoTileFile, TileAddresses, TileFile

router = APIRouter(
    prefix="/api/v1/map", tags=["map"], responses=answers(NotSignedIn, SessionExpired, BadToken, ScopeMissing)
)

FILE_PATH: Final = "/api/v1/map/tiles.pmtiles"
MEDIA_TYPE: Final = "application/vnd.pmtiles"
_KEPT: Final = "private, max-age=604800, no-transform"
"""Cached by the browser only, for a week: the address that the console uses changes with the file."""


class MapView(BaseModel):
    tiles: Annotated[
        Literal["none", "addresses", "file"],
        Field(description="`none`: coastline only; `addresses`: raster tiles elsewhere; `file`: PMTiles, here"),
    ]
    kind: Literal["raster", "vector"] | None
    url: Annotated[str, Field(description="URL template with {z}, {x} and {y}, or URL of the file; may be empty")]
    most_zoom: Annotated[int | None, Field(description="For `addresses`; a file contains its own")]
    attribution: Annotated[str, Field(description="Attribution to show on the map; may be empty")]


@router.get("")
async def get_map(principal: Viewer, settings: SettingsDep) -> MapView:
    """Returns what the console draws over its built-in coastline."""
    match settings.tiles:
        case TileAddresses(template=template):
            return MapView(
                tiles="addresses",
                kind="raster",
                url=template,
                most_zoom=settings.tiles_most_zoom,
                attribution=settings.tiles_attribution,
            )
        case TileFile(kind=kind) as file:
            version = await asyncio.to_thread(_version, file)
            return MapView(
                tiles="file",
                kind=kind,
                url=f"{FILE_PATH}?v={version}",
                most_zoom=None,
                attribution=settings.tiles_attribution,
            )
        case _:
            return MapView(tiles="none", kind=None, url="", most_zoom=None, attribution="")


@router.head("/tiles.pmtiles", include_in_schema=False)
@router.get(
    "/tiles.pmtiles",
    response_class=Response,
    responses={
        200: {"content": {MEDIA_TYPE: {}}, "description": "The whole file"},
        206: {"content": {MEDIA_TYPE: {}}, "description": "The range that was asked for"},
        400: {"description": "The range cannot be read"},
        416: {"description": "The file has no such range"},
        **answers(NoTileFile),
    },
)
async def get_tile_file(principal: Viewer, settings: SettingsDep) -> FileResponse:
    """Returns the tile file, whole or by ranges."""
    source = settings.tiles
    if not isinstance(source, TileFile):
        raise NoTileFile
    try:
        found = await asyncio.to_thread(source.path.stat)
    except OSError:
        raise NoTileFile from None  # it existed when the tower started
    return FileResponse(source.path, media_type=MEDIA_TYPE, headers={"Cache-Control": _KEPT}, stat_result=found)


def _version(file: TileFile) -> str:
    """Changes whenever the file changes."""
    try:
        found = file.path.stat()
    except OSError:
        return "gone"
    return f"{found.st_mtime_ns:x}-{found.st_size:x}"
