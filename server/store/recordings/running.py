"""One recording that goes on, as the service holds it."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from datetime import datetime

from server.live.relay.live_drone import LiveDrone
from server.live.video.streams import StreamKey
from server.store.audit.action import AuditAction
from server.store.recordings.sink import RecordingSink
from server.store.recordings.tables import RecordingRow
from server.store.recordings.writer import UnitWriter
from wire.ids import DroneId


@dataclass(eq=False)
class Running:
    """`began`: monotonic seconds. `ending`: why it is to end, for people, and empty where somebody ended it; None while
    it goes on. `ended_by`: that somebody."""

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
