"""Reads the audit trail: a filter, and pages of matching events, newest first."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from sqlalchemy import Select, func, select

from server.store.audit.tables import AuditEventRow
from server.store.database import Database

ROWS_AT_ONCE: Final = 500


@dataclass(frozen=True)
class AuditFilter:
    """Events must match all given members. `action`: a whole action, or a prefix that ends in a dot; `actor`: a name,
    case-insensitive; `since` is inclusive, `until` exclusive."""

    action: str | None = None
    actor: str | None = None
    drone_id: int | None = None
    since: datetime | None = None
    until: datetime | None = None

    def query(self, *, before: int | None, limit: int) -> Select[AuditEventRow]:
        """Newest first. `before`: only events with a smaller id."""
        query = select(AuditEventRow).order_by(AuditEventRow.id.desc()).limit(limit)
        if self.action is not None and self.action.endswith("."):
            query = query.where(AuditEventRow.action.startswith(self.action, autoescape=True))
        elif self.action is not None:
            query = query.where(AuditEventRow.action == self.action)
        if self.actor is not None:
            query = query.where(func.lower(AuditEventRow.actor_name) == self.actor.lower())
        if self.drone_id is not None:
            query = query.where(AuditEventRow.drone_id == self.drone_id)
        if self.since is not None:
            query = query.where(AuditEventRow.at >= self.since)
        if self.until is not None:
            query = query.where(AuditEventRow.at < self.until)
        return query if before is None else query.where(AuditEventRow.id < before)


async def page(
    database: Database, wanted: AuditFilter, *, before: int | None = None, limit: int = ROWS_AT_ONCE
) -> Sequence[AuditEventRow]:
    """Up to `limit` events, newest first."""
    async with database.reading() as session:
        return (await session.scalars(wanted.query(before=before, limit=limit))).all()


async def pages(database: Database, wanted: AuditFilter, *, limit: int) -> AsyncIterator[Sequence[AuditEventRow]]:
    """Up to `limit` events in pages, each read separately: a slow reader must not block the database."""
    before: int | None = None
    for _ in range(limit // ROWS_AT_ONCE):
        found = await page(database, wanted, before=before)
        if not found:
            return
        before = found[-1].id
        yield found
