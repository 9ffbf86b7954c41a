"""One recording that goes on: which stream it takes, where its units come from, and the thread that writes them.

The relay of video hands units to a sink, which puts them into a bounded place and never waits for the disk."""

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

from server.live.hub import Hub
from server.live.recordings.units import MAGIC, entry_of
from server.live.relay.live_drone import LiveDrone
from server.live.video.situation import VideoCondition, VideoSituation
from server.live.video.streams import StreamKey, StreamSink
from server.store.audit.action import AuditAction
from server.store.recordings.tables import RecordingRow
from wire.ids import DroneId
from wire.video import Codec, Quality, UnitHead


class VideoStreams(Protocol):
    """Every method is plain and returns at once. `now`: monotonic seconds."""

    def attach(self, drone_id: DroneId, sink: StreamSink, now: float) -> bool:
        """From now on the sink gets the units of its stream, beginning with a key picture, and the drone must send
        them. False if there is no such drone."""

    def detach(self, drone_id: DroneId, sink: StreamSink) -> None:
        """It gets no more. Harmless if it was detached already."""

    def situation(self, drone_id: DroneId) -> VideoSituation:
        """How it is with the drone's video now."""

    def wanted(self, drone_id: DroneId) -> Collection[StreamKey]:
        """Which of its streams are watched or recorded."""


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
    """`quality`: None for the best that is watched now. `codecs`: what the agent has; nothing: not known. H.264 before
    MPEG-1: it is kept as it comes."""
    running = [key for key in wanted if quality is None or key.quality is quality]
    if running:
        return max(running, key=lambda key: (key.quality, key.codec is Codec.H264))
    codec = Codec.H264 if Codec.H264 in codecs else Codec.MPEG1
    return StreamKey(USUAL if quality is None else quality, codec)


MAX_WAITING_BYTES: Final = 8 * 1024 * 1024
"""Many seconds of video; a disk that is behind by more does not come back in time."""
SYNC_EVERY_S: Final = 5.0
"""What a power cut may cost. Whatever happens to the tower alone costs nothing that was written."""
CLOSED_WITHIN_S: Final = 10.0
TOO_SLOW: Final = "the tower's disk is too slow to record"


class UnitWriter:
    """`problem`: why nothing is written any more, for people; empty while all is well. `taken_bytes`: all that was put,
    `waiting_bytes`: of it, what the disk does not have yet."""

    def __init__(self, path: Path, *, most_waiting_bytes: int = MAX_WAITING_BYTES) -> None:
        """Makes the file. Raises OSError."""
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
        """Takes one unit, or reports that it cannot. Returns at once."""
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
        """Waits until what was taken is written. Whether it is; if not, the thread still hangs on the disk. Harmless a
        second time."""
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
        """What waits; nothing only when it is closed."""
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
    """A server.live.video.streams.StreamSink. `on_over`: called once with why nothing more is taken. `last_at`: when
    the last unit came, monotonic seconds; the beginning before the first one."""

    def __init__(
        self,
        key: StreamKey,
        writer: UnitWriter,
        *,
        largest_bytes: int,
        began: float,
        on_over: Callable[[str], None],
    ) -> None:
        self._key = key
        self._writer = writer
        self._largest_bytes = largest_bytes
        self._on_over = on_over
        self._over = False
        self.pictures = 0
        self.last_at = began

    @property
    def quality(self) -> Quality:
        return self._key.quality

    @property
    def codec(self) -> Codec:
        return self._key.codec

    def unit(self, message: bytes, head: UnitHead, now: float) -> None:
        """One unit for the file."""
        if self._over:
            return
        if not self._writer.put(message, round(now * 1_000_000)):
            self._end(self._writer.problem)
            return
        self.pictures += 1
        self.last_at = now
        if self._writer.taken_bytes >= self._largest_bytes:
            self._end(TOO_LARGE)

    def state(self, situation: VideoSituation) -> None:
        """A recording waits for a camera that comes back: its pause is a pause in the file."""

    def ended(self, why: str) -> None:
        """Nothing comes any more."""
        self._end(why)

    def _end(self, why: str) -> None:
        if not self._over:
            self._over = True
            self._on_over(why)


@dataclass(eq=False)
class Running:
    """`began`: monotonic seconds. `ending`: why it must end, for people; empty if a user ended it; None while it runs.
    `ended_by`: that user."""

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
    over: asyncio.Event = field(default_factory=asyncio.Event)

    def end(self, words: str, by: AuditAction | None = None) -> None:
        """The first reason counts."""
        if self.ending is None:
            self.ending, self.ended_by = words, by

    def note_flight(self, drone: LiveDrone) -> bool:
        """Whether the drone is on a flight that was not known to be in here."""
        since = drone.flight_start.since if drone.airborne else None
        if since is None or (self.flights and since <= self.flights[-1]):
            return False
        self.flights.append(since)
        return True
