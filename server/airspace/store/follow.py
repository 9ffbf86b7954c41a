"""Keeps the zones of the live picture in step with the database, whichever tower changed them.

Only zones that changed are read, and their geometry is made beside the event loop: 500 of 500 points take a second.
"""

from __future__ import annotations

import asyncio
from typing import Any, Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.airspace.core.zones.service import ZoneService
from server.airspace.store.zones import NUMBERED, VERSIONS, rows_of, zone_of
from server.runtime.aligned_timers import rest
from server.runtime.side_thread import TOWERS_OWN, SideThread
from server.storage.database import Database
from wire.zones.zone import Zone

POLL_S: Final = 3.0
_log = structlog.get_logger(__name__)


class ZoneFollower:
    def __init__(
        self, database: Database, zones: ZoneService, side_thread: SideThread, *, poll_s: float = POLL_S
    ) -> None:
        self._database = database
        self._zones = zones
        self._side_thread = side_thread
        self._poll_s = poll_s
        self._one_at_a_time = asyncio.Lock()
        self._applied: tuple[Any, ...] | None = None
        self._known: dict[int, Zone] = {}

    async def refresh(self) -> None:
        """When it returns, changes committed before the call count."""
        async with self._one_at_a_time:
            async with self._database.reading() as session:
                versions = tuple((await session.execute(VERSIONS)).one())
                if versions == self._applied:
                    return
                there = {row.id: row.version for row in await session.execute(NUMBERED)}
                known = {one.id: one for one in self._known.values() if there.get(one.id) == one.version}
                rows = await rows_of(session, there.keys() - known.keys())
            changed = await self._side_thread.in_turn(TOWERS_OWN, lambda: [zone_of(row) for row in rows])
            known |= {zone.id: zone for zone in changed}
            self._known = known
            self._zones.replace(known[zone_id] for zone_id in sorted(known))
            self._applied = versions

    async def follow(self) -> None:
        """Runs until cancelled. An unreachable database leaves the zones as they are."""
        while True:
            await rest(self._poll_s)
            try:
                await self.refresh()
            except (SQLAlchemyError, OSError) as error:
                _log.debug("zones_not_read", error=type(error).__name__)
