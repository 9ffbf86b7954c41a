"""Areas of map layers that are kept for when the network is away: chosen by an admin, fetched in the background."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import structlog
from sqlalchemy import func, select

from server.audit.store.action import AuditAction
from server.kernel.names import clean_name
from server.maps.core import MAX_AREAS, BadMapLayer, TooManyMapLayers, UnknownMapArea
from server.maps.io.area_tiles import MAX_AREA_TILES, USUAL_TILE_BYTES, Area, area_tiles, count_tiles
from server.maps.io.tile_proxy import TileLayer, TileProxy
from server.maps.io.tile_store import TileName
from server.maps.io.upstream import ServerRests, TileUnavailable
from server.maps.store.layers import KnownLayer, MapLayers
from server.maps.store.tables import MapAreaRow
from server.storage.database import Database

AT_A_TIME: Final = 4
AGAIN_AFTER_S: Final = 30.0
"""Tiles that could not be fetched are tried again."""
MIN_FREE_BYTES: Final = 512_000_000
_log = structlog.get_logger(__name__)


@dataclass(frozen=True, slots=True)
class Estimate:
    tiles: int
    bytes: int


@dataclass(slots=True)
class Progress:
    done: int = 0
    failed: int = 0
    bytes: int = 0
    problem: str = ""


@dataclass(frozen=True, slots=True)
class KnownArea:
    id: int
    name: str
    layer: KnownLayer
    area: Area
    max_zoom: int
    tiles: int
    progress: Progress = field(default_factory=Progress)


class MapAreas:
    def __init__(self, database: Database, layers: MapLayers, proxy: TileProxy) -> None:
        self._database = database
        self._layers = layers
        self._proxy = proxy
        self._progress: dict[int, Progress] = {}
        self._wake = asyncio.Event()

    async def estimate(self, layer_id: int, area: Area, max_zoom: int) -> Estimate:
        """Raises UnknownMapLayer, BadMapLayer."""
        layer = await self._layers.get(layer_id)
        return self._estimated(layer, area, max_zoom)

    async def all(self) -> Sequence[KnownArea]:
        layers = {one.id: one for one in await self._layers.all()}
        async with self._database.reading() as session:
            rows = list(await session.scalars(select(MapAreaRow).order_by(MapAreaRow.id)))
        return [
            KnownArea(
                row.id,
                row.name,
                layers[row.layer_id],
                Area(row.south, row.west, row.north, row.east),
                row.max_zoom,
                row.tiles,
                self._progress.setdefault(row.id, Progress()),
            )
            for row in rows
            if row.layer_id in layers
        ]

    async def add(self, name: str, layer_id: int, area: Area, max_zoom: int, action: AuditAction) -> None:
        """Raises BadName, UnknownMapLayer, BadMapLayer, TooManyMapLayers."""
        layer, name = await self._layers.get(layer_id), clean_name(name)
        estimated = self._estimated(layer, area, max_zoom)
        if not layer.about.may_be_kept:
            raise BadMapLayer(f"the terms of {layer.about.name} do not allow an area to be kept")
        try:
            free = await asyncio.to_thread(self._proxy.store.free_bytes)
        except OSError as error:
            raise BadMapLayer(f"nothing can be kept ({error.strerror})") from None
        if estimated.bytes + MIN_FREE_BYTES > free:
            raise BadMapLayer("the disk of the tower has no room for this area")
        async with self._database.writing() as session:
            if (await session.scalar(select(func.count(MapAreaRow.id))) or 0) >= MAX_AREAS:
                raise TooManyMapLayers
            row = MapAreaRow(
                name=name,
                layer_id=layer_id,
                south=area.south,
                west=area.west,
                north=area.north,
                east=area.east,
                max_zoom=min(max_zoom, layer.about.max_zoom),
                tiles=estimated.tiles,
                created_at=action.at,
            )
            session.add(row)
            await session.flush()
            action.record(
                session, "map.area_kept", area_id=row.id, area=name, layer=layer.about.name, tiles=estimated.tiles
            )
        self._wake.set()

    async def remove(self, area_id: int, action: AuditAction) -> None:
        """Raises UnknownMapArea."""
        known = await self.all()
        async with self._database.writing() as session:
            row = await session.get(MapAreaRow, area_id)
            if row is None:
                raise UnknownMapArea
            await session.delete(row)
            action.record(session, "map.area_let_go", area_id=area_id, area=row.name)
        self._progress.pop(area_id, None)
        await asyncio.to_thread(self._let_go, known, area_id)

    async def run(self) -> None:
        """Fetches what is missing, for ever."""
        while True:
            self._wake.clear()
            is_whole = True
            for area in await self.all():
                is_whole = await self._fetch(area) and is_whole
            try:
                async with asyncio.timeout(None if is_whole else AGAIN_AFTER_S):
                    await self._wake.wait()
            except TimeoutError:
                pass

    async def _fetch(self, area: KnownArea) -> bool:
        """Returns whether all of it is here."""
        progress, tiles = Progress(), area.layer.tiles
        self._progress[area.id] = progress
        missing = await asyncio.to_thread(self._missing, area, progress)
        waiting = iter(missing)

        async def work() -> None:
            for name in waiting:
                if self._progress.get(area.id) is not progress:
                    return  # removed meanwhile
                try:
                    size = await asyncio.to_thread(self._keep, tiles, name)
                except ServerRests:
                    return
                except TileUnavailable as error:
                    progress.failed += 1
                    progress.problem = str(error)
                except OSError as error:
                    progress.problem = f"cannot be stored ({error.strerror})"
                    return
                else:
                    progress.done += 1
                    progress.bytes += size

        await asyncio.gather(*(work() for _ in range(AT_A_TIME)))
        if self._progress.get(area.id) is not progress:
            await asyncio.to_thread(self._let_go, [*await self.all(), area], area.id)
            return True
        _log.info("map_area_kept", area=area.name, done=progress.done, failed=progress.failed)
        return progress.done >= area.tiles

    def _missing(self, area: KnownArea, progress: Progress) -> list[TileName]:
        missing = []
        for name in _names(area):
            found = self._proxy.store.kept_bytes(name)
            if found is None:
                missing.append(name)
            else:
                progress.done += 1
                progress.bytes += found
        return missing

    def _keep(self, layer: TileLayer, name: TileName) -> int:
        content = self._proxy.tile(layer, name.zoom, name.x, name.y) or b""
        self._proxy.store.keep(name, content)
        return len(content)

    def _let_go(self, areas: Sequence[KnownArea], area_id: int) -> None:
        """Removes the tiles that no other area needs."""
        needed = {name for area in areas if area.id != area_id for name in _names(area)}
        gone = (name for area in areas if area.id == area_id for name in _names(area))
        self._proxy.store.let_go(name for name in gone if name not in needed)

    def _estimated(self, layer: KnownLayer, area: Area, max_zoom: int) -> Estimate:
        if not (-90 <= area.south < area.north <= 90):
            raise BadMapLayer("the area has no height")
        tiles = count_tiles(area, min(max_zoom, layer.about.max_zoom))
        if tiles > MAX_AREA_TILES:
            raise BadMapLayer(f"that is {tiles:,} tiles; at most {MAX_AREA_TILES:,} are kept for an area")
        mean = self._proxy.store.mean_bytes(layer.tiles.source) or USUAL_TILE_BYTES
        return Estimate(tiles, tiles * mean)


def _names(area: KnownArea) -> list[TileName]:
    layer = area.layer.tiles
    return [layer.name(*tile) for tile in area_tiles(area.area, area.max_zoom)]
