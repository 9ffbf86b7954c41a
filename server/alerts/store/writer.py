"""Stores alerts in the background: neither the rules nor a person's acknowledgement waits for the database.

Of an alert that changes again before it is written, only the newest state is. An acknowledgement has a row in the audit
trail, in the same transaction.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from dataclasses import dataclass
from typing import Final

import structlog
from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError

from server.alerts.core.alert import Alert
from server.alerts.store.tables import AlertRow
from server.audit.store.trail import Actor, record
from server.kernel.clock import Clock
from server.kernel.shares import ShareName, Shares
from server.storage.database import Database

AT_ONCE: Final = 200
TRY_AGAIN_AFTER_S: Final = 1.0
CAUGHT_UP_WITHIN_S: Final = 5.0
_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class Acknowledgement:
    """For the audit trail."""

    actor: Actor
    address: str
    request_id: str


class AlertWriter:
    """One instance per tower."""

    def __init__(self, database: Database, clock: Clock, shares: Shares | None = None) -> None:
        self._shares = shares or Shares()
        self._database = database
        self._clock = clock
        self._waiting: dict[int, Alert] = {}
        self._of: Counter[int | None] = Counter()
        """How many of them are of a drone; None: of the tower."""
        self._acknowledged: dict[int, Acknowledgement] = {}
        self._something = asyncio.Event()
        self.lost = 0
        """States of alerts that were not stored because too many waited, since the tower started."""

    def changed(self, alert: Alert) -> None:
        """The alert is to be stored as it is when its turn comes."""
        if alert.id not in self._waiting:
            if self._of[alert.drone_id] >= self._shares.limit(ShareName.ALERTS):
                self.lost += 1  # people are told of it all the same
                _log.error("alert_not_stored", alert=alert.id, rule=alert.rule.name, drone_id=alert.drone_id)
                return
            self._of[alert.drone_id] += 1
        self._waiting[alert.id] = alert
        self._something.set()

    def acknowledged(self, alert: Alert, by: Acknowledgement) -> None:
        """A person has acknowledged it, for the audit trail."""
        self._acknowledged[alert.id] = by
        self.changed(alert)

    def waiting_by_drone(self) -> Counter[int | None]:
        """How many wait of each drone; None: of the tower."""
        return +self._of

    def waiting(self) -> list[Alert]:
        """Alerts whose stored rows are not up to date."""
        return list(self._waiting.values())

    async def work(self) -> None:
        """Runs until cancelled; then writes what is queued, if the database allows."""
        try:
            while True:
                await self._something.wait()
                self._something.clear()
                await self._write_all()
        finally:
            await self._write_last()

    async def _write_all(self) -> None:
        while self._waiting:
            try:
                await self._write_once()
            except (SQLAlchemyError, OSError) as error:
                _log.error("alerts_not_stored_yet", error=type(error).__name__)
                await asyncio.sleep(TRY_AGAIN_AFTER_S)

    async def _write_last(self) -> None:
        try:
            async with asyncio.timeout(CAUGHT_UP_WITHIN_S):
                while self._waiting:
                    await self._write_once()
        except (SQLAlchemyError, OSError) as error:  # TimeoutError is an OSError
            _log.error("alerts_not_stored", count=len(self._waiting), error=type(error).__name__)

    async def _write_once(self) -> None:
        batch = {alert_id: row_of(alert) for alert_id, alert in list(self._waiting.items())[:AT_ONCE]}
        acknowledged = {alert_id: self._acknowledged[alert_id] for alert_id in batch if alert_id in self._acknowledged}
        before = {alert_id: _state(self._waiting[alert_id]) for alert_id in batch}
        async with self._database.writing() as session:
            stored = select(AlertRow).where(AlertRow.id.in_(batch))
            known = {row.id: row for row in await session.scalars(stored)}
            for alert_id, row in batch.items():
                if alert_id in known:
                    await session.merge(row)  # asks nothing: the session has it
                else:
                    session.add(row)
                if alert_id in acknowledged:
                    by = acknowledged[alert_id]
                    record(
                        session,
                        at=row.acknowledged_at or self._clock(),
                        actor=by.actor,
                        action="alert.acknowledged",
                        address=by.address,
                        drone_id=row.drone_id,
                        detail={"alert": str(alert_id), "rule": row.rule, "words": row.words},
                        request_id=by.request_id,
                    )
        for alert_id in acknowledged:
            del self._acknowledged[alert_id]
        for alert_id, state in before.items():
            if _state(self._waiting[alert_id]) == state:  # else it has changed meanwhile, and is written again
                written = self._waiting.pop(alert_id)
                self._of[written.drone_id] -= 1


def row_of(alert: Alert) -> AlertRow:
    """The row of an alert as it is now."""
    by = alert.acknowledged_by
    return AlertRow(
        id=alert.id,
        rule=alert.rule.name,
        subject=alert.subject[:64],
        severity=alert.rule.severity.value,
        badge=alert.rule.badge,
        drone_id=alert.drone_id,
        other_id=alert.other_id,
        about_stranger=alert.about_stranger,
        words=alert.words[:600],
        opened_at=alert.opened_at,
        acknowledged_at=alert.acknowledged_at,
        acknowledged_by_id=by.id if by else None,
        acknowledged_by_name=by.name[:64] if by else "",
        closed_at=alert.closed_at,
        closed_why=alert.closed_why[:200],
    )


def _state(alert: Alert) -> tuple[object, ...]:
    return alert.words, alert.acknowledged_at, alert.closed_at
