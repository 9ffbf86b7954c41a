"""Map layers from other servers, as admins choose them: kept in the database, each change with its audit record."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Final, NamedTuple

from sqlalchemy import func, select

from server.audit.store.action import AuditAction
from server.kernel.names import clean_name
from server.maps.core import MAX_LAYERS, BadMapLayer, LayerRole, TooManyMapLayers, UnknownMapLayer
from server.maps.io.tile_proxy import TileLayer
from server.maps.io.tile_source import TileAddresses, read_tiles
from server.maps.io.upstream import Upstream
from server.maps.store.tables import MapLayerRow
from server.storage.database import Database

KNOWN_FOR_S: Final = 5.0
"""Another tower on this database may have changed them."""
MAX_TEMPLATE: Final = 1_000
_WMTS: Final = (("{TileMatrix}", "{z}"), ("{TileRow}", "{y}"), ("{TileCol}", "{x}"))


class NewLayer(NamedTuple):
    """`template`: {z}, {x}, {y}, or WMTS's {TileMatrix}, {TileCol}, {TileRow}."""

    name: str
    role: LayerRole
    template: str
    max_zoom: int
    tile_size: int
    attribution: str
    may_be_private: bool
    may_be_kept: bool


class KnownLayer(NamedTuple):
    id: int
    about: NewLayer

    @property
    def tiles(self) -> TileLayer:
        return TileLayer(Upstream(self.about.template, self.about.may_be_private), self.about.max_zoom)


class MapLayers:
    def __init__(self, database: Database) -> None:
        self._database = database
        self._known: tuple[KnownLayer, ...] = ()
        self._until = 0.0

    @property
    def known(self) -> Sequence[KnownLayer]:
        """As last read."""
        return self._known

    async def all(self) -> Sequence[KnownLayer]:
        if time.monotonic() >= self._until:
            async with self._database.reading() as session:
                rows = await session.scalars(select(MapLayerRow).order_by(MapLayerRow.id))
                self._known = tuple(_known(row) for row in rows)
            self._until = time.monotonic() + KNOWN_FOR_S
        return self._known

    async def get(self, layer_id: int) -> KnownLayer:
        """Raises UnknownMapLayer."""
        found = next((one for one in await self.all() if one.id == layer_id), None)
        if found is None:
            raise UnknownMapLayer
        return found

    async def add(self, new: NewLayer, action: AuditAction) -> KnownLayer:
        """Raises BadName, BadMapLayer, TooManyMapLayers."""
        checked = new._replace(name=clean_name(new.name), template=checked_template(new.template))
        async with self._database.writing() as session:
            if (await session.scalar(select(func.count(MapLayerRow.id))) or 0) >= MAX_LAYERS:
                raise TooManyMapLayers
            row = MapLayerRow(**checked._asdict(), created_at=action.at)
            session.add(row)
            await session.flush()
            # Without the address: it may contain a key.
            action.record(session, "map.layer_added", layer_id=row.id, layer=checked.name, role=checked.role)
            known = _known(row)
        self._until = 0.0
        await self.all()
        return known

    async def remove(self, layer_id: int, action: AuditAction) -> KnownLayer:
        """Raises UnknownMapLayer."""
        async with self._database.writing() as session:
            row = await session.get(MapLayerRow, layer_id)
            if row is None:
                raise UnknownMapLayer
            known = _known(row)
            await session.delete(row)
            action.record(session, "map.layer_removed", layer_id=layer_id, layer=known.about.name)
        self._until = 0.0
        await self.all()
        return known


def checked_template(text: str) -> str:
    """Raises BadMapLayer."""
    for theirs, ours in _WMTS:
        text = text.replace(theirs, ours)
    text = text.strip()
    if len(text) > MAX_TEMPLATE:
        raise BadMapLayer(f"the address must have at most {MAX_TEMPLATE} characters")
    try:
        source = read_tiles(text) if "://" in text else None
    except ValueError as error:
        raise BadMapLayer(f"the address {error}") from None
    if not isinstance(source, TileAddresses):
        raise BadMapLayer("the address must begin with https:// or http://")
    return source.template


def _known(row: MapLayerRow) -> KnownLayer:
    return KnownLayer(row.id, NewLayer(**{field: getattr(row, field) for field in NewLayer._fields}))
