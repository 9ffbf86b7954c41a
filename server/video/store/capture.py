"""One running recording: which stream it records, the source of its units, and the thread that writes them.

The video relay passes units to a sink, which puts them into a bounded queue and never waits for the disk.
"""

from __future__ import annotations

import asyncio
import errno
import os
import threading
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import IO, Final, Protocol

from server.audit.store.action import AuditAction
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.video.core.recordings.units import MAGIC, Taken, entry_of, taken_us
from server.video.core.situation import VideoCondition, VideoSituation
from server.video.core.streams import StreamKey, StreamSink
from server.video.store.tables import RecordingRow
from wire.ids import DroneId
from wire.video import Codec, Quality, UnitHead


class VideoStreams(Protocol):
    """Every method is synchronous and returns at once. `now`: monotonic seconds."""

    def attach(self, drone_id: DroneId, sink: StreamSink, now: float) -> bool:
        """The sink receives the units of its stream from now on, starting with a key picture; the drone is asked for
        them. False if there is no such drone."""

    def detach(self, drone_id: DroneId, sink: StreamSink) -> None:
        """The sink receives no more units. Harmless if it was already detached."""

    def situation(self, drone_id: DroneId) -> VideoSituation:
        """The present state of the drone's video."""

    def wanted(self, drone_id: DroneId) -> Collection[StreamKey]:
        """The drone's streams that are being watched or recorded."""


class HubVideo(VideoStreams):
    """The video of a running tower."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub

    def attach(self, drone_id: DroneId, sink: StreamSink, now: float) -> bool:
        return self._hub.video.attach(drone_id, sink, now)

    def detach(self, drone_id: DroneId, sink: StreamSink) -> None:
        self._hub.video.detach(drone_id, sink)

    def situation(self, drone_id: DroneId) -> VideoSituation:
        drone, now = self._hub.state.drones.get(drone_id), time.monotonic()
        if drone is None:
            return VideoSituation(VideoCondition.OFFLINE)
        best = max(self.wanted(drone_id), default=StreamKey(Quality.MEDIUM, Codec.MPEG1))
        return self._hub.video.video_of(drone, now).situation(best, now)

    def wanted(self, drone_id: DroneId) -> Collection[StreamKey]:
        drone = self._hub.state.drones.get(drone_id)
        if drone is None:
            return ()
        video = self._hub.video.video_of(drone, time.monotonic())
        return {key for key, flow in video.flows.items() if flow.taken}


USUAL: Final = Quality.MEDIUM


def choose(quality: Quality | None, *, wanted: Collection[StreamKey], codecs: Collection[Codec]) -> StreamKey:
    """`quality`: None for the best that is watched now. `codecs`: of the agent; empty: not known. Prefers H.264 over
    MPEG-1, because it is stored without recoding."""
    running = [key for key in wanted if quality is None or key.quality is quality]
    if running:
        return max(running, key=lambda key: (key.quality, key.codec is Codec.H264))
    codec = Codec.H264 if Codec.H264 in codecs else Codec.MPEG1
    return StreamKey(USUAL if quality is None else quality, codec)


MAX_WAITING_BYTES: Final = 8 * 1024 * 1024
"""Many seconds of video; a disk that is further behind does not catch up in time."""
SYNC_EVERY_S: Final = 5.0
"""Maximum loss in a power failure. If only the tower fails, no written data is lost."""
CLOSED_WITHIN_S: Final = 10.0
TOO_SLOW: Final = "the tower's disk is too slow to record"


class UnitWriter:
    """`problem`: why writing has stopped, as text for people; empty if all is well. `taken_bytes`: all bytes put,
    `waiting_bytes`: those not on disk yet."""

    def __init__(self, path: Path, *, most_waiting_bytes: int = MAX_WAITING_BYTES) -> None:
        """Creates the file. Raises OSError."""
        self.problem = ""
        self.taken_bytes = len(MAGIC)
        self.waiting_bytes = 0
        self._most = most_waiting_bytes
        self._entries: list[tuple[bytes, int]] = []
        self._changed = threading.Condition()
        self._closing = False
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._file: IO[bytes] = path.open("xb")
        self._synced_at = time.monotonic()
        self._thread = threading.Thread(target=self._work, name=f"recording {path.name}", daemon=True)
        self._thread.start()

    def put(self, message: bytes, came_us: int) -> bool:
        """Accepts one unit, or returns False. Returns at once."""
        with self._changed:
            if self.problem or self._closing:
                return False
            if self.waiting_bytes + len(message) > self._most:
                self.problem = TOO_SLOW
                return False
            self._entries.append((message, came_us))
            self.waiting_bytes += len(message)
            self.taken_bytes += len(message)
            self._changed.notify()
        return True

    def close(self) -> bool:
        """Waits until all accepted units are written. Returns whether they are; if not, the thread still hangs on the
        disk. A second call is harmless."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(CLOSED_WITHIN_S)
        return not self._thread.is_alive()

    def _work(self) -> None:
        try:
            with self._file:
                self._file.write(MAGIC)
                while entries := self._next():
                    self._file.writelines(entry_of(*entry) for entry in entries)
                    self._file.flush()
                    self._done(sum(len(message) for message, _ in entries))
                    self._sync(at_least_s=SYNC_EVERY_S)
                self._file.flush()
                self._sync(at_least_s=0.0)
        except OSError as error:
            full = error.errno in (errno.ENOSPC, errno.EDQUOT)
            with self._changed:
                self.problem = "the tower's disk is full" if full else f"the tower's disk: {error.strerror or error}"
                self._entries.clear()
                self.waiting_bytes = 0

    def _next(self) -> list[tuple[bytes, int]]:
        """Waits for queued entries; returns none only when closed."""
        with self._changed:
            while not self._entries and not self._closing:
                self._changed.wait()
            entries, self._entries = self._entries, []
            return entries

    def _done(self, written: int) -> None:
        with self._changed:
            self.waiting_bytes -= written

    def _sync(self, *, at_least_s: float) -> None:
        if time.monotonic() - self._synced_at >= at_least_s:
            os.fdatasync(self._file.fileno())
            self._synced_at = time.monotonic()


TOO_LARGE: Final = "it has reached the largest size of a recording"


class RecordingSink:
    """A server.video.core.streams.StreamSink. `on_over`: called once with the reason why no more units are accepted.
    `on_first`: called once, when the first picture has come. `wall_clock`: of a moment in monotonic seconds. `last_at`:
    when the last unit arrived, in monotonic seconds; the beginning before the first one."""

    def __init__(
        self,
        key: StreamKey,
        writer: UnitWriter,
        *,
        largest_bytes: int,
        began: float,
        wall_clock: Callable[[float], datetime],
        on_first: Callable[[], None],
        on_over: Callable[[str], None],
    ) -> None:
        self._key = key
        self._writer = writer
        self._largest_bytes = largest_bytes
        self._wall_clock = wall_clock
        self._on_first = on_first
        self._on_over = on_over
        self._over = False
        self.first_picture_at: datetime | None = None
        """When the first picture was taken, or when it came if the time of capture is not known."""
        self.pictures = 0
        self.last_at = began

    @property
    def quality(self) -> Quality:
        return self._key.quality

    @property
    def codec(self) -> Codec:
        return self._key.codec

    def unit(self, message: bytes, head: UnitHead, now: float) -> None:
        """Writes one unit to the file."""
        if self._over:
            return
        came_us = round(now * 1_000_000)
        if not self._writer.put(message, came_us):
            self._end(self._writer.problem)
            return
        if self.first_picture_at is None and head.key:
            taken = taken_us(Taken(head.capture_us, came_us, head.rate_hz))
            self.first_picture_at = self._wall_clock(taken / 1_000_000)
            self._on_first()
        self.pictures += 1
        self.last_at = now
        if self._writer.taken_bytes >= self._largest_bytes:
            self._end(TOO_LARGE)

    def state(self, situation: VideoSituation) -> None:
        """A recording waits for a camera to return: its pause is a pause in the file."""

    def ended(self, why: str) -> None:
        """No more units arrive."""
        self._end(why)

    def _end(self, why: str) -> None:
        if not self._over:
            self._over = True
            self._on_over(why)


@dataclass(eq=False)
class Running:
    """`began`: monotonic seconds. `ending`: why it must end, as text for people, empty if a user ended it; None while
    it runs. `ended_by`: that user. `first_noted`: whether the row has the time of the first picture."""

    row: RecordingRow
    drone_id: DroneId
    key: StreamKey
    writer: UnitWriter
    sink: RecordingSink
    began: float
    flights: list[datetime] = field(default_factory=list)
    ending: str | None = None
    ended_by: AuditAction | None = None
    detached: bool = False
    first_noted: bool = False
    over: asyncio.Event = field(default_factory=asyncio.Event)

    def end(self, words: str, by: AuditAction | None = None) -> None:
        """The first reason counts."""
        if self.ending is None:
            self.ending, self.ended_by = words, by

    def note_flight(self, drone: LiveDrone) -> bool:
        """Returns whether the drone is on a flight that is new to this recording."""
        since = drone.flight_start.since if drone.airborne else None
        if since is None or (self.flights and since <= self.flights[-1]):
            return False
        self.flights.append(since)
        return True
