"""Keeps recordings within their budget: the oldest that are over go first, never one that goes on or is being
finished. Files that the database does not know count too, and go by their age as all others do."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import structlog

from server.audit.deed import Deed
from server.audit.trail import TOWER
from server.clock import Clock
from server.database import Database
from server.file_room import to_remove
from server.recordings import catalogue
from server.recordings.store import RecordingStore, Stray
from server.recordings.tables import RecordingRow
from server.recordings.telling import RecordingTelling
from server.recordings.views import RecordingView
from wire.video import LARGEST_UNIT_BYTES

LEAST_ROOM_BYTES: Final = LARGEST_UNIT_BYTES
"""Without it nothing is begun."""
AT_ONCE: Final = 100
"""Rows that are looked at together: making objects of thousands would hold up the tower's loop."""


_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class _Kept:
    what: RecordingRow | Stray
    size_bytes: int
    kept_at: float


class RecordingRoom:
    """`in_use`: bytes of what goes on. `kept_bytes`: of all that is over, as it was seen last. `strays`: files that the
    database does not know, the oldest first."""

    def __init__(
        self,
        *,
        database: Database,
        clock: Clock,
        store: RecordingStore,
        telling: RecordingTelling,
        budget_bytes: int,
    ) -> None:
        self._database = database
        self._clock = clock
        self._store = store
        self._telling = telling
        self.budget_bytes = budget_bytes
        self.in_use: Callable[[], int] = lambda: 0
        self.kept_bytes = 0
        self.strays: list[Stray] = []
        self._one_at_a_time = asyncio.Lock()

    async def make(self, coming_bytes: int) -> bool:
        """Removes what has to go so that so much more fits. Whether it fits now: also on the disk."""
        async with self._one_at_a_time:
            async with self._database.reading() as session:
                being_finished, over = await catalogue.bytes_of_store(session, self._store.id)
            self.kept_bytes = over + self.stray_bytes()
            used = self.in_use() + being_finished + coming_bytes
            while self.kept_bytes and used + self.kept_bytes > self.budget_bytes:
                await self._remove_oldest(used)
            if used + self.kept_bytes > self.budget_bytes:
                return False
            return await asyncio.to_thread(self._store.has_room, coming_bytes)

    def stray_bytes(self) -> int:
        """Of files that the database does not know."""
        return sum(one.size_bytes for one in self.strays)

    async def _remove_oldest(self, used: int) -> None:
        """Some of those that have to go beside so many bytes."""
        async with self._database.reading() as session:
            rows = await catalogue.oldest_over(session, self._store.id, most=AT_ONCE)
        # Rows that were not looked at may be older than a stray that is younger than these.
        until = rows[-1].began_at.timestamp() if len(rows) == AT_ONCE else float("inf")
        oldest = [_Kept(row, row.size_bytes, row.began_at.timestamp()) for row in rows]
        oldest += [_Kept(one, one.size_bytes, one.kept_at) for one in self.strays if one.kept_at <= until]
        others = self.kept_bytes - sum(one.size_bytes for one in oldest)
        for one in to_remove(oldest, coming_bytes=used + others, budget_bytes=self.budget_bytes):
            if isinstance(one.what, Stray):
                await self._remove_stray(one.what)
            else:
                await self._remove(one.what)
            self.kept_bytes -= one.size_bytes
        if not oldest:
            self.kept_bytes = 0

    async def _remove_stray(self, stray: Stray) -> None:
        await asyncio.to_thread(self._store.remove_stray, stray)
        self.strays.remove(stray)
        _log.warning("recording_not_in_the_database_removed", file=str(stray.path), size_bytes=stray.size_bytes)

    async def _remove(self, row: RecordingRow) -> None:
        deed = Deed(by=TOWER, at=self._clock())
        async with self._database.writing() as session:
            removed = await catalogue.remove_for_room(session, row.id, deed=deed)
        if removed is not None:
            await asyncio.to_thread(self._store.remove, removed.drone_id, removed.file)
            self._telling.tell("removed", RecordingView.of(removed))
