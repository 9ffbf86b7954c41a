"""Lists alerts, newest first: the stored ones, with the present state of those that the tower has in memory."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from sqlalchemy import Select, or_, select

from server.alerts.core.alert import Alert
from server.alerts.core.severity import Severity
from server.alerts.store.tables import AlertRow
from server.alerts.store.writer import row_of
from server.storage.database import Database, DatabaseSession
from server.storage.in_slices import in_slices

ROWS_AT_ONCE: Final = 500
ALERTS_AT_ONCE: Final = 50
"""Made into rows before the event loop passes frames on: two milliseconds."""
MAX_PAGES: Final = 10
"""Pages read for one answer: rows that this user may not know of are left out after reading."""


@dataclass(frozen=True)
class AlertFilter:
    """Alerts must match all given members. `since` is inclusive, `until` exclusive, both of the opening."""

    drone_ids: frozenset[int] = frozenset()
    """Only these."""
    of_tower: bool = False
    """Also alerts of the tower itself."""
    is_open: bool | None = None
    is_acknowledged: bool | None = None
    severity: Severity | None = None
    rule: str | None = None
    since: datetime | None = None
    until: datetime | None = None

    def matches(self, row: AlertRow) -> bool:
        """The same in memory."""
        return (
            (self.of_tower if row.drone_id is None else row.drone_id in self.drone_ids)
            and (self.is_open is None or (row.closed_at is None) is self.is_open)
            and (self.is_acknowledged is None or (row.acknowledged_at is not None) is self.is_acknowledged)
            and (self.severity is None or row.severity == self.severity.value)
            and (self.rule is None or row.rule == self.rule)
            and (self.since is None or row.opened_at >= self.since)
            and (self.until is None or row.opened_at < self.until)
        )

    def query(self) -> Select[AlertRow]:
        """Newest first."""
        about = AlertRow.drone_id.in_(sorted(self.drone_ids))
        found = select(AlertRow).where(about | AlertRow.drone_id.is_(None) if self.of_tower else about)
        if self.is_open is not None:
            found = found.where(AlertRow.closed_at.is_(None) if self.is_open else AlertRow.closed_at.is_not(None))
        if self.is_acknowledged is not None:
            at = AlertRow.acknowledged_at
            found = found.where(at.is_not(None) if self.is_acknowledged else at.is_(None))
        if self.severity is not None:
            found = found.where(AlertRow.severity == self.severity.value)
        if self.rule is not None:
            found = found.where(AlertRow.rule == self.rule)
        if self.since is not None:
            found = found.where(AlertRow.opened_at >= self.since)
        if self.until is not None:
            found = found.where(AlertRow.opened_at < self.until)
        return found.order_by(AlertRow.opened_at.desc(), AlertRow.id.desc())


async def list_alerts(
    database: Database,
    wanted: AlertFilter,
    *,
    in_memory: Iterable[Alert],
    may_know: Callable[[AlertRow], bool],
    before: int | None,
    limit: int,
) -> list[AlertRow]:
    """Up to `limit` alerts. `in_memory`: those whose stored rows may be out of date; `before`: the id of an alert, only
    those that follow it in the list."""
    newest: dict[int, AlertRow] = {}
    for number, alert in enumerate(in_memory, 1):
        newest[alert.id] = row_of(alert)
        if number % ALERTS_AT_ONCE == 0:
            await asyncio.sleep(0)
    place: tuple[datetime, int] | None = None
    if before is not None:
        place = await _place(database, before, newest)
        if place is None:
            return []
    found = [row for row in newest.values() if wanted.matches(row) and may_know(row) and _follows(row, place)]
    found += await _stored(database, wanted, newest.keys(), may_know, place, limit)
    return sorted(found, key=lambda row: (row.opened_at, row.id), reverse=True)[:limit]


async def _stored(
    database: Database,
    wanted: AlertFilter,
    without: Iterable[int],
    may_know: Callable[[AlertRow], bool],
    place: tuple[datetime, int] | None,
    limit: int,
) -> list[AlertRow]:
    found: list[AlertRow] = []
    left_out = frozenset(without)
    for _ in range(MAX_PAGES):
        async with database.reading() as session:
            rows = await _page(session, wanted, place)
        found += [row for row in rows if row.id not in left_out and may_know(row)]
        if len(found) >= limit or len(rows) < ROWS_AT_ONCE:
            break
        place = rows[-1].opened_at, rows[-1].id
    return found[:limit]


async def _page(
    session: DatabaseSession, wanted: AlertFilter, place: tuple[datetime, int] | None
) -> Sequence[AlertRow]:
    query = wanted.query().limit(ROWS_AT_ONCE)
    if place is not None:
        at, number = place
        query = query.where(AlertRow.opened_at <= at, or_(AlertRow.opened_at < at, AlertRow.id < number))
    return [row for (row,) in await in_slices(session, query)]


async def _place(database: Database, alert_id: int, newest: dict[int, AlertRow]) -> tuple[datetime, int] | None:
    if alert_id in newest:
        return newest[alert_id].opened_at, alert_id
    async with database.reading() as session:
        at = await session.scalar(select(AlertRow.opened_at).where(AlertRow.id == alert_id))
    return None if at is None else (at, alert_id)


def _follows(row: AlertRow, place: tuple[datetime, int] | None) -> bool:
    return place is None or (row.opened_at, row.id) < place
