"""`/api/v1/map/...` for admins: layers from other servers, map files, and areas kept for when the network is away."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator
from dataclasses import asdict
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, Field
from starlette.requests import ClientDisconnect

from server.http.access import Admin
from server.http.dependencies import AuditDep, DatabaseDep, SettingsDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired
from server.kernel.names import BadName
from server.maps.api.dependencies import ElevationUploadsDep, MapAreasDep, MapFolderDep, MapLayersDep, TileProxyDep
from server.maps.core import (
    PRESETS,
    BadMapFile,
    BadMapLayer,
    TooManyMapLayers,
    UnknownMapArea,
    UnknownMapLayer,
)
from server.maps.io.area_tiles import Area
from server.maps.io.map_upload import MapUpload
from server.maps.store.areas import KnownArea
from server.maps.store.layers import KnownLayer, NewLayer

router = APIRouter(prefix="/api/v1/map", tags=["map"], responses=answers(NotSignedIn, SessionExpired, AdminsOnly))

LayerPath = Annotated[int, Path(ge=1, le=2**31 - 1)]
FilePath = Annotated[str, Path(pattern=r"^[a-z0-9][a-z0-9_-]{0,79}$")]
Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
MEDIA_TYPE: Final = "application/vnd.pmtiles"


class LayerBody(BaseModel):
    name: str
    role: Literal["imagery", "map", "terrain"]
    template: Annotated[str, Field(description="With {z}, {x}, {y}; or WMTS's {TileMatrix}, {TileCol}, {TileRow}")]
    max_zoom: Annotated[int, Field(ge=0, le=24)] = 19
    tile_size: Literal[256, 512] = 256
    attribution: Annotated[str, Field(max_length=200)] = ""
    may_be_private: Annotated[bool, Field(description="Its server may be in a private network")] = False
    may_be_kept: Annotated[bool, Field(description="Its terms allow an area to be downloaded ahead")] = False


class AdminLayerView(LayerBody):
    id: int

    @classmethod
    def of(cls, known: KnownLayer) -> AdminLayerView:
        return cls(id=known.id, **known.about._asdict())


class PresetView(BaseModel):
    key: str
    name: str
    role: Literal["imagery", "map", "terrain"]
    template: str
    max_zoom: int
    attribution: str
    terms_url: str
    terms: str
    may_be_kept: bool


class FileView(BaseModel):
    name: str
    bytes: int | None
    role: str | None
    problem: Annotated[str, Field(description="Why it cannot be drawn; empty if it can")]


class AreaBody(BaseModel):
    name: str
    layer_id: Annotated[int, Field(ge=1)]
    south: Latitude
    west: Longitude
    north: Latitude
    east: Longitude
    max_zoom: Annotated[int, Field(ge=0, le=22)]

    @property
    def area(self) -> Area:
        return Area(self.south, self.west, self.north, self.east)


class EstimateView(BaseModel):
    tiles: int
    bytes: int


class AreaView(AreaBody):
    id: int
    tiles: int
    done: Annotated[int, Field(description="Tiles that are here")]
    failed: int
    bytes: int
    problem: Annotated[str, Field(description="Why tiles are missing, as last seen; empty: none")]

    @classmethod
    def of(cls, known: KnownArea) -> AreaView:
        area, progress = known.area, known.progress
        return cls(
            id=known.id,
            name=known.name,
            layer_id=known.layer.id,
            south=area.south,
            west=area.west,
            north=area.north,
            east=area.east,
            max_zoom=known.max_zoom,
            tiles=known.tiles,
            done=progress.done,
            failed=progress.failed,
            bytes=progress.bytes,
            problem=progress.problem if progress.done < known.tiles else "",
        )


class ConversionView(BaseModel):
    name: str
    is_running: bool
    share: Annotated[float, Field(description="That is done, 0 to 1")]
    problem: Annotated[str, Field(description="What is wrong, in words that follow the name; or empty")]


class MapAdminView(BaseModel):
    layers: list[AdminLayerView]
    files: list[FileView]
    areas: list[AreaView]
    presets: list[PresetView]
    cache_bytes: int
    cache_max_bytes: int
    upload_max_bytes: int
    elevation: Annotated[ConversionView | None, Field(description="The GeoTIFF uploaded last")]


@router.get("/admin")
async def get_map_admin(
    admin: Admin,
    layers: MapLayersDep,
    areas: MapAreasDep,
    proxy: TileProxyDep,
    folder: MapFolderDep,
    uploads: ElevationUploadsDep,
    settings: SettingsDep,
) -> MapAdminView:
    """Returns all map layers, files and kept areas, and the public sources to choose from."""
    good, bad = await asyncio.to_thread(folder.look)
    files = [FileView(name=one.name, bytes=one.bytes, role=one.role, problem="") for one in good]
    files += [FileView(name=one.name, bytes=None, role=None, problem=one.problem) for one in bad]
    latest = uploads.latest
    return MapAdminView(
        layers=[AdminLayerView.of(one) for one in await layers.all()],
        files=sorted(files, key=lambda one: one.name),
        areas=[AreaView.of(one) for one in await areas.all()],
        presets=[PresetView(**{name: getattr(one, name) for name in PresetView.model_fields}) for one in PRESETS],
        cache_bytes=await asyncio.to_thread(lambda: proxy.store.cached_bytes),
        cache_max_bytes=settings.tile_cache_mb * 1_000_000,
        upload_max_bytes=settings.map_file_largest_mb * 1_000_000,
        elevation=None if latest is None else ConversionView(**asdict(latest)),
    )


@router.post("/layers", status_code=201, responses=answers(BadName, BadMapLayer, TooManyMapLayers))
async def add_map_layer(admin: Admin, layers: MapLayersDep, audit: AuditDep, body: LayerBody) -> AdminLayerView:
    """Adds a layer of raster tiles from another server, which the tower fetches and caches."""
    return AdminLayerView.of(await layers.add(NewLayer(**body.model_dump()), audit.action(admin)))


@router.delete("/layers/{layer_id}", status_code=204, responses=answers(UnknownMapLayer))
async def remove_map_layer(
    admin: Admin, layers: MapLayersDep, proxy: TileProxyDep, audit: AuditDep, layer_id: LayerPath
) -> None:
    """Removes a layer, its kept areas and its cached tiles."""
    removed = await layers.remove(layer_id, audit.action(admin))
    if all(one.tiles.source != removed.tiles.source for one in layers.known):
        await asyncio.to_thread(proxy.store.forget, removed.tiles.source)


@router.post("/areas/estimate", responses=answers(UnknownMapLayer, BadMapLayer))
async def estimate_map_area(admin: Admin, areas: MapAreasDep, body: AreaBody) -> EstimateView:
    """Returns how many tiles an area has, and about how many bytes."""
    found = await areas.estimate(body.layer_id, body.area, body.max_zoom)
    return EstimateView(tiles=found.tiles, bytes=found.bytes)


@router.post("/areas", status_code=202, responses=answers(BadName, UnknownMapLayer, BadMapLayer, TooManyMapLayers))
async def keep_map_area(admin: Admin, areas: MapAreasDep, audit: AuditDep, body: AreaBody) -> None:
    """Keeps an area of a layer for when the network is away. `GET /map/admin` has the progress."""
    await areas.add(body.name, body.layer_id, body.area, body.max_zoom, audit.action(admin))


@router.delete("/areas/{area_id}", status_code=204, responses=answers(UnknownMapArea))
async def let_map_area_go(admin: Admin, areas: MapAreasDep, audit: AuditDep, area_id: LayerPath) -> None:
    """Removes a kept area."""
    await areas.remove(area_id, audit.action(admin))


_FILE: Final[dict[str, Any]] = {
    "requestBody": {"required": True, "content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}}
}


@router.put("/files/{name}", status_code=204, responses=answers(BadMapFile), openapi_extra=_FILE)
async def put_map_file(
    request: Request,
    admin: Admin,
    folder: MapFolderDep,
    settings: SettingsDep,
    database: DatabaseDep,
    audit: AuditDep,
    name: FilePath,
) -> None:
    """Uploads a PMTiles file. It is a layer as soon as it is whole, in place of one of the same name."""
    upload = MapUpload(folder.folder, name, settings.map_file_largest_mb * 1_000_000)
    size = await upload.receive(request.headers.get("content-length", ""), pieces_of(request))
    async with database.writing() as session:
        audit.action(admin).record(session, "map.file_added", file=name, bytes=size)


@router.delete("/files/{name}", status_code=204, responses=answers(BadMapFile))
async def remove_map_file(
    admin: Admin, folder: MapFolderDep, database: DatabaseDep, audit: AuditDep, name: FilePath
) -> None:
    """Removes a file of the folder of maps."""
    try:
        await asyncio.to_thread(os.unlink, folder.folder / f"{name}.pmtiles")
    except OSError:
        raise BadMapFile("there is no such map file, or it cannot be removed") from None
    async with database.writing() as session:
        audit.action(admin).record(session, "map.file_removed", file=name)


async def pieces_of(request: Request) -> AsyncIterator[bytes]:
    """Raises BadMapFile if the connection breaks off."""
    try:
        async for piece in request.stream():
            yield piece
    except ClientDisconnect:
        raise BadMapFile("the connection broke off") from None
