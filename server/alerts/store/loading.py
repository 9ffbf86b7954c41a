"""Reads the alerts that are open, or wait for a person: after a restart, or those of another tower."""

from __future__ import annotations

import time
from collections.abc import Collection
from datetime import timedelta
from typing import Final

from sqlalchemy import or_, select

from server.alerts.core.alert import Alert
from server.alerts.core.announcer import Announcer
from server.alerts.core.left_alerts import OpenAlert
from server.alerts.core.rules import BY_NAME
from server.alerts.core.severity import Severity
from server.alerts.store.tables import AlertRow
from server.kernel.clock import Clock
from server.kernel.people import UserRef
from server.live.hub import Hub
from server.storage.database import Database
from wire.ids import DroneId, UserId

AWAITED_FOR: Final = timedelta(hours=24)
"""An alert that has been over for longer waits for nobody."""
MAX_LOADED: Final = 5_000
MAX_AT_ONCE: Final = 500
"""Named in one query."""


async def read_alerts(
    database: Database, clock: Clock, *, of: Collection[DroneId] | None = None, of_tower: str = ""
) -> list[Alert]:
    """Those whose rule this version has, oldest first. `of`: of these drones alone, and of the tower of that name."""
    unread = AlertRow.acknowledged_at.is_(None) & (AlertRow.severity == Severity.CRITICAL.value)
    recent = AlertRow.closed_at >= clock() - AWAITED_FOR
    query = select(AlertRow).where(or_(AlertRow.closed_at.is_(None), recent & unread))
    if of is not None:
        towers_own = AlertRow.drone_id.is_(None) & (AlertRow.subject == of_tower)
        query = query.where(or_(AlertRow.drone_id.in_(of), towers_own))
    async with database.reading() as session:
        rows = (await session.scalars(query.order_by(AlertRow.opened_at.desc()).limit(MAX_LOADED))).all()
    return [alert_of(row) for row in reversed(rows) if row.rule in BY_NAME]


async def read_open(database: Database) -> list[OpenAlert]:
    """Every alert that has not ended: little of each, for a look every few seconds."""
    query = select(AlertRow.id, AlertRow.rule, AlertRow.subject, AlertRow.drone_id).where(AlertRow.closed_at.is_(None))
    async with database.reading() as session:
        rows = await session.execute(query.order_by(AlertRow.opened_at.desc()).limit(MAX_LOADED))
        return [
            OpenAlert(row.id, row.rule, row.subject, None if row.drone_id is None else DroneId(row.drone_id))
            for row in rows
        ]


async def read_open_of(database: Database, alert_ids: Collection[int]) -> list[Alert]:
    """Those of these alerts that are open and whose rule this version has, oldest first."""
    query = select(AlertRow).where(AlertRow.id.in_(list(alert_ids)[:MAX_AT_ONCE]), AlertRow.closed_at.is_(None))
    async with database.reading() as session:
        rows = (await session.scalars(query.order_by(AlertRow.opened_at))).all()
    return [alert_of(row) for row in rows if row.rule in BY_NAME]


def restore_alerts(hub: Hub, announcer: Announcer, alerts: list[Alert], clock: Clock) -> None:
    """They go on here. The announcer comes first: some end at once, and that is news."""
    announcer.restored(alerts, clock())
    hub.alerts.restore(alerts, time.monotonic())


async def load_alerts(hub: Hub, announcer: Announcer, database: Database, clock: Clock) -> None:
    """At start, after the hub knows the drones and before agents get responses."""
    restore_alerts(hub, announcer, await read_alerts(database, clock), clock)


def alert_of(row: AlertRow) -> Alert:
    """An alert whose rule this version has."""
    by = row.acknowledged_by_id
    return Alert(
        id=row.id,
        rule=BY_NAME[row.rule],
        subject=row.subject,
        drone_id=None if row.drone_id is None else DroneId(row.drone_id),
        words=row.words,
        opened_at=row.opened_at,
        other_id=None if row.other_id is None else DroneId(row.other_id),
        about_stranger=row.about_stranger,
        acknowledged_at=row.acknowledged_at,
        acknowledged_by=None if by is None else UserRef(UserId(by), row.acknowledged_by_name),
        closed_at=row.closed_at,
        closed_why=row.closed_why,
    )
