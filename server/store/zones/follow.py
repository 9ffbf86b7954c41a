"""Keeps the zones of the live picture in step with the database, whichever tower changed them."""

from __future__ import annotations

import asyncio
from typing import Any, Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.live.zones.service import ZoneService
from server.runtime.aligned_timers import rest
from server.store.database import Database
from server.store.zones.zones import VERSIONS, all_zones

POLL_S: Final = 3.0
_log = structlog.get_logger(__name__)


class ZoneFollower:
    def __init__(self, database: Database, zones: ZoneService, *, poll_s: float = POLL_S) -> None:
        self._database = database
        self._zones = zones
        self._poll_s = poll_s
        self._one_at_a_time = asyncio.Lock()
        self._applied: tuple[Any, ...] | None = None

    async def refresh(self) -> None:
        """When it returns, changes committed before the call count."""
        async with self._one_at_a_time:
            async with self._database.reading() as session:
                versions = tuple((await session.execute(VERSIONS)).one())
                if versions == self._applied:
                    return
                zones = await all_zones(session)
            self._zones.replace(zones)
            self._applied = versions

    async def follow(self) -> None:
        """Runs until cancelled. An unreachable database leaves the zones as they are."""
        while True:
            await rest(self._poll_s)
            try:
                await self.refresh()
            except (SQLAlchemyError, OSError) as error:
                _log.debug("zones_not_read", error=type(error).__name__)
