"""The recordings of the tower: begun, monitored, ended, and passed on to be finished.

Units go from the relay to a writer's thread without waiting. Everything else happens here in the background: limits,
flights, rows. Writes that the database refuses are retried; a recording ends on its disk in any case.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from collections import Counter
from contextlib import suppress
from datetime import datetime, timedelta
from typing import Final

import structlog
from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from server.audit.store.action import AuditAction
from server.audit.store.trail import TOWER
from server.kernel.access import UnknownDrone
from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.core.refusals import DroneOffline
from server.storage.database import Database
from server.video.core.recordings.notifier import RecordingNotifier
from server.video.core.recordings.refusals import (
    AlreadyRecording,
    NoVideo,
    RecordingStorageFull,
    TooManyRecordings,
)
from server.video.core.recordings.views import RecordingView
from server.video.core.situation import VideoCondition
from server.video.core.streams import StreamKey
from server.video.store import catalogue
from server.video.store.capture import RecordingSink, Running, UnitWriter, VideoStreams, choose
from server.video.store.finisher import RecordingFinisher
from server.video.store.quota import MIN_ROOM_BYTES, RecordingQuota
from server.video.store.store import UNITS, RecordingStore
from server.video.store.tables import RecordingRow
from wire.ids import DroneId
from wire.video import Quality

MAX_RUNNING: Final = 50
"""Each has a thread, and a queue for what its disk does not have yet."""
CHECK_EVERY_S: Final = 1.0
ROOM_EVERY_S: Final = 5.0
NOTHING_COMES_S: Final = 600.0
STOPPED_WITHIN_S: Final = 15.0
GOING_DOWN: Final = "the tower was stopped"
TOO_LONG: Final = "it has reached the longest time of a recording"
NOTHING_CAME: Final = "no picture came for ten minutes"
NOT_HERE: Final = "its file is not in this tower's folder of recordings"
NO_STORE: Final = "the tower could not open its folder of recordings when it started"
NO_ROOM: Final = "the tower has no room left for recordings"
_log = structlog.get_logger(__name__)


class RecordingService:
    """One instance per tower. `work` runs in the background. `video`: the source of units."""

    def __init__(
        self,
        *,
        hub: Hub,
        video: VideoStreams,
        database: Database,
        clock: Clock,
        store: RecordingStore,
        quota: RecordingQuota,
        finisher: RecordingFinisher,
        notifier: RecordingNotifier,
        largest_bytes: int,
        longest_s: float,
    ) -> None:
        self._hub = hub
        self.video = video
        self._database = database
        self._clock = clock
        self._store = store
        self._quota = quota
        self._finisher = finisher
        self._notifier = notifier
        self._largest_bytes = largest_bytes
        self._longest_s = longest_s
        self._taken: set[tuple[DroneId, Quality]] = set()
        self._running: dict[int, Running] = {}
        self._something = asyncio.Event()
        self._one_at_a_time = asyncio.Lock()
        """Of ticks: two would end the same recording."""
        self._quota_checked_at = float("-inf")
        quota.in_use = self._running_by_drone

    # -- running recordings ----------------------------------------------------------------------------------

    def view(self, row: RecordingRow) -> RecordingView:
        """Returns the view with the bytes recorded so far."""
        view = catalogue.view_of(row)
        if row.state == "ready" and row.store != self._store.id:
            return view.model_copy(update={"words": NOT_HERE})
        running = self._running.get(row.id)
        if running is None or row.state != "recording":
            return view
        counts = {"size_bytes": running.writer.taken_bytes, "pictures": running.sink.pictures}
        times = {"first_picture_at": running.sink.first_picture_at, "flights": list(running.flights)}
        return view.model_copy(update=counts | times)

    def running_bytes(self) -> int:
        """Bytes being recorded."""
        return sum(one.writer.taken_bytes for one in self._running.values())

    def _running_by_drone(self) -> Counter[int]:
        by_drone = Counter[int]()
        for one in self._running.values():
            by_drone[one.drone_id] += one.writer.taken_bytes
        return by_drone

    def waiting_bytes(self) -> int:
        """Bytes not on disk yet."""
        return sum(one.writer.waiting_bytes for one in self._running.values())

    def running(self) -> int:
        """The number of running recordings."""
        return len(self._running)

    async def begin(
        self, drone: LiveDrone, by: Principal, quality: Quality | None, action: AuditAction
    ) -> RecordingView:
        """Raises DroneOffline, NoVideo, AlreadyRecording, TooManyRecordings, RecordingStorageFull."""
        drone_id, name = drone.drone_id, drone.record.name
        situation = self.video.situation(drone_id)
        if situation.condition is VideoCondition.OFFLINE:
            raise DroneOffline(name)
        if situation.condition is VideoCondition.NO_CAMERA:
            raise NoVideo(situation.words or f"{name} has no camera")
        key = choose(quality, wanted=self.video.wanted(drone_id), codecs=situation.codecs)
        place = (drone_id, key.quality)
        if place in self._taken:
            raise AlreadyRecording(name, key.quality.name.lower())
        if len(self._taken) >= MAX_RUNNING:
            raise TooManyRecordings
        if not self._store.id:
            raise RecordingStorageFull(NO_STORE)
        self._taken.add(place)
        try:
            if not await self._quota.make_space(MIN_ROOM_BYTES, drone_id):
                raise RecordingStorageFull(NO_ROOM)
            row = RecordingRow(
                drone_id=drone_id,
                store=self._store.id,
                file=secrets.token_hex(8),
                by_id=by.user_id,
                by_name=by.name,
                quality=key.quality.name.lower(),
                codec=key.codec.name.lower(),
                state="recording",
                words="",
                began_at=action.at,
                flights=[],
                size_bytes=0,
                pictures=0,
            )
            try:
                async with self._database.writing() as session:
                    session.add(row)
                    await session.flush()
                    action.record(session, "recording.began", drone_id=drone_id, **catalogue.about(row))
            except IntegrityError:  # the drone was just deleted
                raise UnknownDrone from None
            path = self._store.path(drone_id, row.file, UNITS)
            try:
                writer = await asyncio.to_thread(UnitWriter, path)
            except OSError as error:
                words = f"the tower cannot keep files: {error.strerror or error}"
                async with self._database.writing() as session:
                    await catalogue.mark_failed(session, row.id, words, size_bytes=0)
                raise RecordingStorageFull(words) from None
        except BaseException:
            self._taken.discard(place)
            raise
        return self._attach(row, drone, writer, key)

    def _attach(self, row: RecordingRow, drone: LiveDrone, writer: UnitWriter, key: StreamKey) -> RecordingView:
        now = time.monotonic()

        def over(why: str) -> None:
            running.end(why)
            self._something.set()

        sink = RecordingSink(
            key,
            writer,
            largest_bytes=self._largest_bytes,
            began=now,
            wall_clock=self._wall_clock,
            on_first=self._something.set,
            on_over=over,
        )
        running = Running(row, drone.drone_id, key, writer, sink, now)
        running.note_flight(drone)
        self._running[row.id] = running
        if not self.video.attach(drone.drone_id, sink, now):
            over("the drone was removed")
        view = self.view(row)
        self._notifier.publish("begun", view)
        return view

    def _wall_clock(self, at: float) -> datetime:
        return self._clock() - timedelta(seconds=time.monotonic() - at)

    async def end(self, recording_id: int, action: AuditAction) -> None:
        """A user ends it. Returns when it has ended; harmless if it already has."""
        running = self._running.get(recording_id)
        if running is None:
            return
        running.end("", action)
        self._something.set()
        with suppress(TimeoutError):
            async with asyncio.timeout(STOPPED_WITHIN_S):
                await running.over.wait()

    # -- background work -------------------------------------------------------------------------------------

    async def work(self) -> None:
        """Runs until cancelled."""
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(CHECK_EVERY_S):
                    await self._something.wait()
            self._something.clear()
            await self.tick(time.monotonic())

    async def tick(self, now: float) -> None:
        """Ends recordings that are due, and records which flights the others show."""
        async with self._one_at_a_time:
            await self._look(now)

    async def _look(self, now: float) -> None:
        if self._running and now - self._quota_checked_at >= ROOM_EVERY_S:
            self._quota_checked_at = now
            if not await self._quota.make_space(0):
                # The largest one of the largest account.
                going_on = self._running.values()
                max(going_on, key=lambda one: (self._quota.hogs_most(one.drone_id), one.writer.taken_bytes)).end(
                    NO_ROOM
                )
        for running in list(self._running.values()):
            await self._check(running, now)
        for running in [one for one in self._running.values() if one.ending is not None]:
            await self._end(running)

    async def _check(self, running: Running, now: float) -> None:
        drone = self._hub.state.drones.get(running.drone_id)
        if drone is None:
            running.end("the drone was removed")
        elif running.writer.problem:
            running.end(running.writer.problem)
        elif now - running.began >= self._longest_s:
            running.end(TOO_LONG)
        elif now - running.sink.last_at >= NOTHING_COMES_S:
            running.end(NOTHING_CAME)
        elif running.note_flight(drone) or (running.sink.first_picture_at is not None and not running.first_noted):
            first_picture_at = running.sink.first_picture_at
            async with self._database.writing() as session:
                row = await session.get(RecordingRow, running.row.id)
                if row is not None:
                    row.flights = [one.isoformat() for one in running.flights]
                    row.first_picture_at = first_picture_at
            running.first_noted = first_picture_at is not None

    async def _end(self, running: Running) -> None:
        if not running.detached:
            running.detached = True
            self.video.detach(running.drone_id, running.sink)
        closed = await asyncio.to_thread(running.writer.close)
        words = running.ending or ("" if closed else "the tower's disk does not answer")
        action = running.ended_by or AuditAction(by=TOWER, at=self._clock())
        async with self._database.writing() as session:
            row = await catalogue.mark_ended(
                session,
                running.row.id,
                words=words,
                at=action.at,
                size_bytes=running.writer.taken_bytes,
                pictures=running.sink.pictures,
                first_picture_at=running.sink.first_picture_at,
                flights=running.flights,
                action=action,
            )
        del self._running[running.row.id]
        self._taken.discard((running.drone_id, running.key.quality))
        running.over.set()
        if row is None:
            await asyncio.to_thread(self._store.remove, running.drone_id, running.row.file)
            return
        self._notifier.publish("ended", catalogue.view_of(row))
        self._finisher.add(row.id)

    async def close(self) -> None:
        """The tower stops: running recordings end, and are finished at the next start."""
        for running in list(self._running.values()):
            running.end(GOING_DOWN)
            try:
                await self._end(running)
            except (SQLAlchemyError, OSError):
                _log.exception("recording_not_ended", recording=running.row.id)
