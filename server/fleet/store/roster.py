"""Keeps the live picture in step with the database, whether this process or `tower drone add` changed it."""

from __future__ import annotations

import asyncio
from typing import Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.fleet.core.live_picture import LivePicture
from server.fleet.store.snapshot import REVISION, load_snapshot
from server.kernel.clock import Clock
from server.runtime.aligned_timers import rest
from server.storage.database import Database

POLL_S: Final = 1.0
_log = structlog.get_logger(__name__)


class Roster:
    def __init__(self, database: Database, picture: LivePicture, clock: Clock, *, poll_s: float = POLL_S) -> None:
        self._database = database
        self._picture = picture
        self._clock = clock
        self._poll_s = poll_s
        self._one_at_a_time = asyncio.Lock()
        self._applied = -1

    @property
    def revision(self) -> int:
        """The newest revision in the live picture; -1 before the first."""
        return self._applied

    async def refresh(self) -> None:
        """Loads the fleet into the live picture. When it returns, changes committed before the call are applied."""
        async with self._one_at_a_time:
            async with self._database.reading() as session:
                snapshot = await load_snapshot(session, self._clock())
            if snapshot.revision > self._applied:
                self._applied = snapshot.revision
                self._picture.apply_fleet(snapshot)

    async def follow(self) -> None:
        """Runs until cancelled. Logs an unreachable database once, not every second, and leaves the fleet as it is."""
        in_reach, revision = True, self._database.repeated(REVISION)
        while True:
            await rest(self._poll_s)
            try:
                newest = await self._database.ask(revision) or 0
                if newest > self._applied:
                    await self.refresh()
            except (SQLAlchemyError, OSError) as error:
                if in_reach:
                    _log.error("database_lost", error=type(error).__name__)
                in_reach = False
            else:
                if not in_reach:
                    _log.info("database_back")
                in_reach = True
