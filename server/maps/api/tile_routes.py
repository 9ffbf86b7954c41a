"""`/api/v1/map/layers/...`: tiles of other servers, through the tower. Browsers contact no stranger."""

from __future__ import annotations

import asyncio
from typing import Annotated, Final

from fastapi import APIRouter, Path
from fastapi.responses import Response

from server.http.access import Viewer
from server.http.dependencies import SettingsDep
from server.http.problem_docs import answers
from server.kernel.access import BadToken, NotSignedIn, ScopeMissing, SessionExpired
from server.maps.api.dependencies import MapLayersDep, TileProxyDep
from server.maps.core import MapTileUnavailable, UnknownMapLayer
from server.maps.io.tile_proxy import TileLayer
from server.maps.io.tile_source import TileAddresses
from server.maps.io.upstream import TileUnavailable, Upstream, media_type
from server.runtime.settings import Settings

router = APIRouter(
    prefix="/api/v1/map", tags=["map"], responses=answers(NotSignedIn, SessionExpired, BadToken, ScopeMissing)
)

CONFIGURED: Final = 0
"""The layer of `TOWER_TILES`, where that is an address."""
_KEPT: Final = "private, max-age=86400"
Zoom = Annotated[int, Path(ge=0, le=24)]
Number = Annotated[int, Path(ge=0, lt=1 << 24)]


def configured_layer(settings: Settings) -> TileLayer | None:
    """Whoever sets the environment of the tower may name a server of their own network."""
    if not isinstance(settings.tiles, TileAddresses):
        return None
    return TileLayer(Upstream(settings.tiles.template, may_be_private=True), settings.tiles_most_zoom)


@router.get(
    "/layers/{layer_id}/{zoom}/{x}/{y}",
    response_class=Response,
    responses={
        200: {"content": {"image/*": {}}, "description": "The tile"},
        204: {"description": "Its server has no such tile"},
        **answers(UnknownMapLayer, MapTileUnavailable),
    },
)
async def get_map_tile(
    principal: Viewer,
    layers: MapLayersDep,
    proxy: TileProxyDep,
    settings: SettingsDep,
    layer_id: Annotated[int, Path(ge=0, le=2**31 - 1)],
    zoom: Zoom,
    x: Number,
    y: Number,
) -> Response:
    """Returns a tile of a layer from the tower's cache, or from its server."""
    layer = configured_layer(settings) if layer_id == CONFIGURED else (await layers.get(layer_id)).tiles
    if layer is None:
        raise UnknownMapLayer
    if not layer.has(zoom, x, y):
        return _sent(None)
    found = await asyncio.to_thread(proxy.stored, layer, zoom, x, y)
    if found is not None and found[1]:
        return _sent(found[0])
    try:
        return _sent(await asyncio.wrap_future(proxy.begin(layer, zoom, x, y)))
    except TileUnavailable as error:
        if found is not None:
            return _sent(found[0])
        raise MapTileUnavailable(str(error)) from None


def _sent(tile: bytes | None) -> Response:
    kind = media_type(tile[:16]) if tile else None
    headers = {"Cache-Control": _KEPT}
    return Response(tile, media_type=kind, headers=headers) if kind else Response(status_code=204, headers=headers)
