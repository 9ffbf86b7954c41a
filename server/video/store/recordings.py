"""The parts of recording, assembled for one tower."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

from server.kernel.clock import Clock
from server.live.hub import Hub
from server.runtime.background import in_background
from server.runtime.settings import Settings
from server.storage.database import Database
from server.storage.file_accounts import file_accounts
from server.video.core.recordings.notifier import RecordingNotifier
from server.video.store.capture import VideoStreams
from server.video.store.finisher import RecordingFinisher
from server.video.store.quota import RecordingQuota
from server.video.store.service import RecordingService
from server.video.store.store import RecordingStore

_MB = 1_000_000


@dataclass(frozen=True)
class Recordings:
    service: RecordingService
    store: RecordingStore
    quota: RecordingQuota
    finisher: RecordingFinisher
    notifier: RecordingNotifier

    @asynccontextmanager
    async def working(self, deleted: frozenset[int]) -> AsyncIterator[None]:
        """Resumes what an earlier tower left, and works until the block ends. `deleted`: drones whose files are
        removed."""
        await self.finisher.recover(deleted)
        if self.store.id:
            await self.quota.make_space(0)
        try:
            async with (
                in_background("finishing recordings", self.finisher.work),
                in_background("recordings", self.service.work),
            ):
                yield
        finally:
            await self.service.close()


def new_recordings(
    settings: Settings, *, hub: Hub, video: VideoStreams, database: Database, clock: Clock
) -> Recordings:
    budget_bytes = settings.recordings_budget_mb * _MB
    store = RecordingStore(settings.files / "recordings")
    notifier = RecordingNotifier(hub)
    quota = RecordingQuota(
        database=database,
        clock=clock,
        store=store,
        notifier=notifier,
        budget_bytes=budget_bytes,
        accounts=lambda: file_accounts(hub),
    )
    finisher = RecordingFinisher(database=database, store=store, quota=quota, notifier=notifier)
    service = RecordingService(
        hub=hub,
        video=video,
        database=database,
        clock=clock,
        store=store,
        quota=quota,
        finisher=finisher,
        notifier=notifier,
        largest_bytes=min(budget_bytes, settings.recording_largest_mb * _MB),
        longest_s=settings.recording_longest_s,
    )
    return Recordings(service, store, quota, finisher, notifier)
