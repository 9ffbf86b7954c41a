"""Keeps recordings within their budget: the oldest that are over go first, never one that goes on or is being
finished."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from server.audit.deed import Deed
from server.audit.trail import TOWER
from server.clock import Clock
from server.database import Database
from server.file_room import to_remove
from server.recordings import catalogue
from server.recordings.store import RecordingStore
from server.recordings.tables import RecordingRow
from server.recordings.telling import RecordingTelling
from server.recordings.views import RecordingView
from wire.video import LARGEST_UNIT_BYTES

LEAST_ROOM_BYTES: Final = LARGEST_UNIT_BYTES
"""Without it nothing is begun."""
AT_ONCE: Final = 100
"""Rows that are looked at together: making objects of thousands would hold up the tower's loop."""


@dataclass(frozen=True)
class _Kept:
    row: RecordingRow
    size_bytes: int
    kept_at: float


class RecordingRoom:
    """`in_use`: bytes of what goes on. `kept_bytes`: of all that is over, as it was seen last."""

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
        self._one_at_a_time = asyncio.Lock()

    async def make(self, coming_bytes: int) -> bool:
        """Removes what has to go so that so much more fits. Whether it fits now: also on the disk."""
        async with self._one_at_a_time:
            async with self._database.reading() as session:
                being_finished, self.kept_bytes = await catalogue.bytes_of_store(session, self._store.id)
            used = self.in_use() + being_finished + coming_bytes
            while self.kept_bytes and used + self.kept_bytes > self.budget_bytes:
                await self._remove_oldest(used)
            if used + self.kept_bytes > self.budget_bytes:
                return False
            return await asyncio.to_thread(self._store.has_room, coming_bytes)

    async def _remove_oldest(self, used: int) -> None:
        """Some of those that have to go beside so many bytes."""
        async with self._database.reading() as session:
            rows = await catalogue.oldest_over(session, self._store.id, most=AT_ONCE)
        oldest = [_Kept(row, row.size_bytes, row.began_at.timestamp()) for row in rows]
        others = self.kept_bytes - sum(one.size_bytes for one in oldest)
        for one in to_remove(oldest, coming_bytes=used + others, budget_bytes=self.budget_bytes):
            await self._remove(one.row)
            self.kept_bytes -= one.size_bytes
        if not rows:
            self.kept_bytes = 0

    async def _remove(self, row: RecordingRow) -> None:
        deed = Deed(by=TOWER, at=self._clock())
        async with self._database.writing() as session:
            removed = await catalogue.remove_for_room(session, row.id, deed=deed)
        if removed is not None:
            await asyncio.to_thread(self._store.remove, removed.drone_id, removed.file)
            self._telling.tell("removed", RecordingView.of(removed))
