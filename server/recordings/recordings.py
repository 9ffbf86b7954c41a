"""The parts of recording, put together for one tower."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

from server.background import in_background
from server.clock import Clock
from server.database import Database
from server.file_accounts import file_accounts
from server.recordings.desk import RecordingDesk
from server.recordings.finisher import RecordingFinisher
from server.recordings.room import RecordingRoom
from server.recordings.source import VideoStreams
from server.recordings.store import RecordingStore
from server.recordings.telling import RecordingTelling
from server.relay.hub import Hub
from server.settings import Settings

_MB = 1_000_000


@dataclass(frozen=True)
class Recordings:
    desk: RecordingDesk
    store: RecordingStore
    room: RecordingRoom
    finisher: RecordingFinisher
    telling: RecordingTelling

    @asynccontextmanager
    async def working(self, deleted: frozenset[int]) -> AsyncIterator[None]:
        """Takes up what an earlier tower left, and works until the block ends. `deleted`: drones whose files go."""
        await self.finisher.recover(deleted)
        if self.store.id:
            await self.room.make(0)
        try:
            async with (
                in_background("finishing recordings", self.finisher.work),
                in_background("recordings", self.desk.work),
            ):
                yield
        finally:
            await self.desk.close()


def new_recordings(
    settings: Settings, *, hub: Hub, video: VideoStreams, database: Database, clock: Clock
) -> Recordings:
    budget_bytes = settings.recordings_budget_mb * _MB
    store = RecordingStore(settings.files / "recordings")
    telling = RecordingTelling(hub)
    room = RecordingRoom(
        database=database,
        clock=clock,
        store=store,
        telling=telling,
        budget_bytes=budget_bytes,
        accounts=lambda: file_accounts(hub),
    )
    finisher = RecordingFinisher(database=database, store=store, room=room, telling=telling)
    desk = RecordingDesk(
        hub=hub,
        video=video,
        database=database,
        clock=clock,
        store=store,
        room=room,
        finisher=finisher,
        telling=telling,
        largest_bytes=min(budget_bytes, settings.recording_largest_mb * _MB),
        longest_s=settings.recording_longest_s,
    )
    return Recordings(desk, store, room, finisher, telling)
