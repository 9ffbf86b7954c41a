"""Maintenance by hours in the air. Every function takes a session; the caller checks rights. A change and its audit
record are committed together."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from sqlalchemy import and_, func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.action import AuditAction
from server.flights.store.tables import FlightFiguresRow
from server.readiness.core.maintenance_refusals import TooManyTasks, UnknownTask
from server.readiness.store.task_tables import MaintenanceTaskRow
from server.storage.in_slices import slices

MAX_TASKS: Final = 40
"""Of one drone."""
_SECONDS_AN_HOUR: Final = 3600.0


@dataclass(frozen=True)
class Task:
    """`flown_h`: in the air since `done_at`, of flights that ended later. `done_by` empty: it was not done yet, and the
    hours count from `done_at`."""

    id: int
    drone_id: int
    title: str
    interval_h: float
    done_at: datetime
    done_by: str
    flown_h: float


async def tasks_of(session: AsyncSession, drone_ids: Collection[int]) -> list[Task]:
    """Returns the tasks of these drones, in the order in which they were made."""
    since = and_(
        FlightFiguresRow.drone_id == MaintenanceTaskRow.drone_id,
        FlightFiguresRow.ended_at > MaintenanceTaskRow.done_at,
    )
    flown = select(func.coalesce(func.sum(FlightFiguresRow.flown_s), 0.0)).where(since).scalar_subquery()
    query = select(MaintenanceTaskRow, flown).where(MaintenanceTaskRow.drone_id.in_(drone_ids))
    ordered = query.order_by(MaintenanceTaskRow.id)
    return [_task(row, seconds) async for some in slices(session, ordered) for row, seconds in some]


async def find(session: AsyncSession, task_id: int) -> MaintenanceTaskRow:
    """Raises UnknownTask."""
    row = await session.get(MaintenanceTaskRow, task_id)
    if row is None:
        raise UnknownTask
    return row


async def add(
    session: AsyncSession, *, drone_id: int, title: str, interval_h: float, since: datetime, action: AuditAction
) -> int:
    """`since`: hours count from then on. Returns the id. Raises TooManyTasks."""
    count = await session.scalar(
        select(func.count()).select_from(MaintenanceTaskRow).where(MaintenanceTaskRow.drone_id == drone_id)
    )
    if (count or 0) >= MAX_TASKS:
        raise TooManyTasks(MAX_TASKS)
    row = MaintenanceTaskRow(drone_id=drone_id, title=title, interval_h=interval_h, done_at=since, done_by="")
    session.add(row)
    await session.flush()
    about = {"title": title, "interval_h": interval_h, "since": since.isoformat()}
    action.record(session, "maintenance.added", drone_id=drone_id, task=row.id, **about)
    return row.id


async def change(
    session: AsyncSession, task_id: int, *, title: str | None, interval_h: float | None, action: AuditAction
) -> None:
    """None: stays as it is. Raises UnknownTask."""
    row = await find(session, task_id)
    before = {"title": row.title, "interval_h": row.interval_h}
    row.title = row.title if title is None else title
    row.interval_h = row.interval_h if interval_h is None else interval_h
    after = {"title": row.title, "interval_h": row.interval_h}
    if after != before:
        action.record(session, "maintenance.changed", drone_id=row.drone_id, task=row.id, before=before, **after)


async def done(session: AsyncSession, task_id: int, *, note: str, action: AuditAction) -> None:
    """The hours count anew from now on. Raises UnknownTask."""
    row = await find(session, task_id)
    (before,) = [one for one in await tasks_of(session, [row.drone_id]) if one.id == task_id]
    row.done_at, row.done_by = action.at, action.by.name[:64]
    about = {"title": row.title, "flown_h": round(before.flown_h, 2), "note": note}
    action.record(session, "maintenance.done", drone_id=row.drone_id, task=row.id, **about)


async def remove(session: AsyncSession, task_id: int, *, action: AuditAction) -> None:
    """Raises UnknownTask."""
    row = await find(session, task_id)
    action.record(session, "maintenance.removed", drone_id=row.drone_id, task=row.id, title=row.title)
    await session.delete(row)


def _task(row: MaintenanceTaskRow, seconds: float) -> Task:
    flown_h = float(seconds) / _SECONDS_AN_HOUR
    return Task(row.id, row.drone_id, row.title, row.interval_h, row.done_at, row.done_by, flown_h)
