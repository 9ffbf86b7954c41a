"""Removes what is older than the settings allow, in small steps in the background, so that no other work waits for it.

The audit trail and the alerts have a limit of age and one of size. Flight logs, recordings and flights have a limit of
age here; their size is that of their budgets (`file_budget`). What is being recorded and a log that arrives are never
removed.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

import structlog
from sqlalchemy import Select, delete, func, select

from server.alerts.store.tables import AlertRow
from server.audit.store.chain_tables import AuditChainRow
from server.audit.store.pruning import prune
from server.audit.store.sealer import Signer
from server.audit.store.tables import AuditEventRow
from server.flights.store.quota import FlightQuota
from server.kernel.clock import Clock
from server.logs.store.quota import FlightLogQuota
from server.runtime.settings import Settings
from server.storage.database import Database, DatabaseUnavailable
from server.video.store.quota import RecordingQuota

CHECK_EVERY_S: Final = 60.0
PAUSE_S: Final = 0.25
"""Between two steps: other writers come first."""
EVENTS_A_STEP: Final = 500
FILES_A_STEP: Final = 20
MAX_ALERTS: Final = 100_000
"""Of more alerts than this the oldest go, whatever their age."""
_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class Limits:
    """0: no limit. `max_events`: the newest that the audit trail keeps."""

    audit_days: float = 0
    max_events: int = 0
    flight_log_days: float = 0
    recording_days: float = 0
    flight_days: float = 0
    alert_days: float = 0


class Retention:
    """One instance per tower. `removed`: how many of each kind since its start."""

    def __init__(
        self,
        limits: Limits,
        *,
        database: Database,
        clock: Clock,
        logs: FlightLogQuota,
        recordings: RecordingQuota,
        flights: FlightQuota,
        key: Signer,
    ) -> None:
        """`key`: signs what stands in place of removed audit events."""
        self._key = key
        self._limits = limits
        self._database = database
        self._clock = clock
        self._logs = logs
        self._recordings = recordings
        self._flights = flights
        self.removed: Counter[str] = Counter(alerts=0, audit_events=0, flight_logs=0, recordings=0, flights=0)

    async def work(self) -> None:
        """Runs until cancelled."""
        while True:
            await self.once()
            await asyncio.sleep(CHECK_EVERY_S)

    async def once(self) -> None:
        """Removes everything that is due now."""
        limits = self._limits
        if limits.audit_days:
            await self._in_steps("audit_events", self._old_events)
        if limits.max_events:
            await self._in_steps("audit_events", self._surplus_events)
        if limits.flight_log_days:
            await self._in_steps("flight_logs", self._old_logs)
        if limits.recording_days:
            await self._in_steps("recordings", self._old_recordings)
        if limits.flight_days:
            await self._in_steps("flights", self._old_flights)
        if limits.alert_days:
            await self._in_steps("alerts", self._old_alerts)
        await self._in_steps("alerts", self._surplus_alerts)

    async def _in_steps(self, what: str, step: Callable[[], Awaitable[int]]) -> None:
        count = 0
        try:
            while removed := await step():
                count += removed
                self.removed[what] += removed
                await asyncio.sleep(PAUSE_S)
        except (DatabaseUnavailable, OSError) as error:
            _log.warning("retention_interrupted", what=what, error=type(error).__name__)
        if count:
            _log.info("retention_removed", what=what, count=count)

    def _before(self, days: float) -> datetime:
        return self._clock() - timedelta(days=days)

    async def _old_events(self) -> int:
        old = _chained().where(AuditEventRow.at < self._before(self._limits.audit_days))
        return await self._remove_events(old.order_by(AuditEventRow.at))

    async def _surplus_events(self) -> int:
        async with self._database.reading() as session:
            # Ids have few gaps; counting millions of rows every minute would cost more than keeping some fewer.
            newest = await session.scalar(select(func.max(AuditEventRow.id)))
        until = (newest or 0) - self._limits.max_events
        surplus = _chained().where(AuditEventRow.id <= until)
        return await self._remove_events(surplus.order_by(AuditEventRow.id)) if until > 0 else 0

    async def _remove_events(self, chosen: Select[int]) -> int:
        async with self._database.writing() as session:
            ids = (await session.scalars(chosen.limit(EVENTS_A_STEP))).all()
            return await prune(session, ids, self._key, self._clock())

    async def _old_alerts(self) -> int:
        """One that lasts stays."""
        old = AlertRow.closed_at < self._before(self._limits.alert_days)
        return await self._remove_alerts(select(AlertRow.id).where(old).order_by(AlertRow.closed_at))

    async def _surplus_alerts(self) -> int:
        newest_first = select(AlertRow.opened_at).order_by(AlertRow.opened_at.desc())
        async with self._database.reading() as session:
            last = await session.scalar(newest_first.offset(MAX_ALERTS).limit(1))
        if last is None:
            return 0
        return await self._remove_alerts(select(AlertRow.id).where(AlertRow.opened_at <= last))

    async def _remove_alerts(self, chosen: Select[int]) -> int:
        async with self._database.writing() as session:
            ids = (await session.scalars(chosen.limit(EVENTS_A_STEP))).all()
            if ids:
                await session.execute(delete(AlertRow).where(AlertRow.id.in_(ids)))
            return len(ids)

    async def _old_logs(self) -> int:
        before = self._before(self._limits.flight_log_days).timestamp()
        return await asyncio.to_thread(self._logs.remove_older, before, FILES_A_STEP)

    async def _old_recordings(self) -> int:
        return await self._recordings.remove_older(self._before(self._limits.recording_days), FILES_A_STEP)

    async def _old_flights(self) -> int:
        return await self._flights.remove_older(self._before(self._limits.flight_days), FILES_A_STEP)


def new_retention(
    settings: Settings,
    database: Database,
    clock: Clock,
    *,
    logs: FlightLogQuota,
    recordings: RecordingQuota,
    flights: FlightQuota,
    key: Signer,
) -> Retention:
    """Returns the retention that these settings ask for."""
    limits = Limits(
        audit_days=settings.audit_keep_days,
        max_events=settings.audit_most_events,
        flight_log_days=settings.flight_logs_keep_days,
        recording_days=settings.recordings_keep_days,
        flight_days=settings.flights_keep_days,
        alert_days=settings.alerts_keep_days,
    )
    return Retention(limits, database=database, clock=clock, logs=logs, recordings=recordings, flights=flights, key=key)


def _chained() -> Select[int]:
    """Events that the chain of hashes has."""
    return select(AuditEventRow.id).join(AuditChainRow, AuditChainRow.event_id == AuditEventRow.id)
