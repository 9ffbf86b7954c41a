"""The parts that record flights, assembled for one tower."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Final, TypeVar

import structlog

from server.flights.core.recorder import FlightRecorder
from server.flights.store.files import FlightFiles
from server.flights.store.gaps import GapService
from server.flights.store.quota import FlightQuota
from server.flights.store.service import FlightService
from server.flights.store.writer import FlightWriter
from server.kernel.clock import Clock
from server.live.hub import Hub
from server.runtime.background import in_background
from server.runtime.settings import Settings
from server.storage.database import Database, DatabaseUnavailable
from server.storage.file_accounts import file_accounts

_MB: Final = 1_000_000
MAX_EXPORTS: Final = 2
TOWER_STOPPED: Final = "the tower was stopped"
_Told = TypeVar("_Told")
_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class Flights:
    hub: Hub
    recorder: FlightRecorder
    files: FlightFiles
    writer: FlightWriter
    quota: FlightQuota
    service: FlightService
    gaps: GapService
    before_s: float | None
    """None: flights are not recorded; those that are there can be read."""
    export_turns: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(MAX_EXPORTS))
    """Few exports read at a time: the others wait."""

    @asynccontextmanager
    async def working(self, deleted: frozenset[int]) -> AsyncIterator[None]:
        """Closes what an earlier tower left, and records until the block ends. `deleted`: drones whose files are
        removed. A folder that cannot be used stops no tower."""
        try:
            await asyncio.to_thread(self.files.remove_drones, deleted)
            await asyncio.to_thread(self.files.open)
            await self.service.recover()
            await self.gaps.recover()
        except (OSError, DatabaseUnavailable) as error:
            _log.error("flights_not_recorded", why=str(error))
        self._listen()
        self.writer.start()
        self.recorder.on_begin = self.service.begin
        self.recorder.before_s = self.before_s
        try:
            async with in_background("flights", self.service.work), in_background("flight gaps", self.gaps.work):
                yield
        finally:
            self.recorder.end_all(TOWER_STOPPED, time.monotonic())
            if not await asyncio.to_thread(self.writer.stop):
                _log.error("flights_not_written", waiting_bytes=self.writer.waiting_bytes)

    def _listen(self) -> None:
        """The index has what the audit trail has: after those who act on it."""
        hub, recorder = self.hub, self.recorder
        hub.state.on_event = _then(hub.state.on_event, recorder.noticed)
        hub.operations.on_began = _then(hub.operations.on_began, recorder.operation)
        hub.operations.on_ended = _then(hub.operations.on_ended, recorder.operation)
        hub.observed.on_settled = _then(hub.observed.on_settled, recorder.observed)


def _then(first: Callable[[_Told], None], second: Callable[[_Told], None]) -> Callable[[_Told], None]:
    def both(told: _Told) -> None:
        first(told)
        second(told)

    return both


def new_flights(settings: Settings, *, hub: Hub, database: Database, clock: Clock) -> Flights:
    budget_bytes = settings.flights_budget_mb * _MB
    files, writer = FlightFiles(settings.files / "flights"), FlightWriter()
    quota = FlightQuota(
        database=database, clock=clock, files=files, budget_bytes=budget_bytes, accounts=lambda: file_accounts(hub)
    )
    service = FlightService(
        database=database,
        clock=clock,
        files=files,
        writer=writer,
        quota=quota,
        largest_bytes=min(budget_bytes, settings.flight_largest_mb * _MB),
    )
    gaps = GapService(database=database, clock=clock, files=files, watch=hub.flights.gaps, fetcher=hub.black_box)
    before_s = settings.flight_before_s if settings.record_flights else None
    return Flights(hub, hub.flights, files, writer, quota, service, gaps, before_s)
