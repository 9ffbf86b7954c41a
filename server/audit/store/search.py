"""Reads the audit trail: a filter, and pages of matching events, newest first.

Every filter reads only the events of its page, however large the trail is. Each combination of person, drone and one
action has an index whose last column is the time (`server/audit/store/tables.py`), so it yields its newest events
without sorting. A filter that leaves the action open, or names a prefix, is the union of its actions: the tower has
about a hundred, and an index lists those that occur without reading the events between them.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final, NamedTuple

from sqlalchemy import ColumnElement, Select, func, or_, select, union_all

from server.audit.store.tables import AuditEventRow, folded_actor
from server.storage.database import Database, DatabaseSession

ROWS_AT_ONCE: Final = 500
ROWS_OF_A_SLICE: Final = 100
"""Of a long download: to make objects of 500 rows kept frames waiting for 25 ms."""
MAX_ACTIONS: Final = 400
"""SQLite unites 500 queries at most. With more actions, which only a foreign program can have written, the search reads
in order of time."""


class Place(NamedTuple):
    """The place of an event in the list: the next page begins after it."""

    at: datetime
    event_id: int


@dataclass(frozen=True)
class AuditFilter:
    """Events must match all given members. `action`: a whole action, or a prefix that ends in a dot; `actor`: a name,
    case-insensitive; `since` is inclusive, `until` exclusive; `request_id`: of the request that caused it."""

    action: str | None = None
    actor: str | None = None
    drone_id: int | None = None
    since: datetime | None = None
    until: datetime | None = None
    request_id: str | None = None

    @property
    def prefix(self) -> str | None:
        return self.action if self.action is not None and self.action.endswith(".") else None

    def subject(self) -> list[ColumnElement[bool]]:
        """What it says of person and drone."""
        found = []
        if self.actor is not None:
            found.append(folded_actor(AuditEventRow.actor_name) == func.lower(self.actor))
        if self.drone_id is not None:
            found.append(AuditEventRow.drone_id == self.drone_id)
        return found

    def others(self) -> list[ColumnElement[bool]]:
        """What it says of time and request."""
        found = []
        if self.since is not None:
            found.append(AuditEventRow.at >= self.since)
        if self.until is not None:
            found.append(AuditEventRow.at < self.until)
        if self.request_id is not None:
            found.append(AuditEventRow.request_id == self.request_id)
        return found


async def page(
    database: Database, wanted: AuditFilter, *, before: int | None = None, limit: int = ROWS_AT_ONCE
) -> Sequence[AuditEventRow]:
    """Up to `limit` events, newest first. `before`: the id of an event; only those that follow it in the list."""
    async with database.reading() as session:
        place = None if before is None else await _place(session, before)
        return await _read(session, wanted, place, limit)


async def pages(database: Database, wanted: AuditFilter, *, limit: int) -> AsyncIterator[Sequence[AuditEventRow]]:
    """Up to `limit` events in pages, each read separately: a slow reader must not block the database."""
    place: Place | None = None
    for _ in range(limit // ROWS_OF_A_SLICE):
        async with database.reading() as session:
            found = await _read(session, wanted, place, ROWS_OF_A_SLICE)
        if not found:
            return
        place = Place(found[-1].at, found[-1].id)
        yield found


async def _place(session: DatabaseSession, event_id: int) -> Place | None:
    """Of an event that has been removed: where it would be. None: before every event that is left."""
    nearest = select(AuditEventRow.at).where(AuditEventRow.id <= event_id).order_by(AuditEventRow.id.desc()).limit(1)
    at = await session.scalar(nearest)
    return None if at is None else Place(at, event_id)


async def _read(
    session: DatabaseSession, wanted: AuditFilter, place: Place | None, limit: int
) -> Sequence[AuditEventRow]:
    conditions = [*wanted.subject(), *wanted.others()]
    if place is not None:
        same = AuditEventRow.id < place.event_id
        conditions += [AuditEventRow.at <= place.at, or_(AuditEventRow.at < place.at, same)]
    query = select(AuditEventRow).order_by(AuditEventRow.at.desc(), AuditEventRow.id.desc()).limit(limit)
    if wanted.action is not None and wanted.prefix is None:
        return (await session.scalars(query.where(AuditEventRow.action == wanted.action, *conditions))).all()
    if wanted.request_id is not None or (wanted.prefix is None and not wanted.subject()):
        return (await session.scalars(_with_prefix(query, wanted).where(*conditions))).all()
    actions = await _actions(session, wanted)
    if len(actions) >= MAX_ACTIONS:
        return (await session.scalars(_with_prefix(query, wanted).where(*conditions))).all()
    if wanted.prefix is not None:
        actions = [one for one in actions if one.startswith(wanted.prefix)]
    return (await session.scalars(_united(actions, conditions, limit))).all() if actions else ()


def _with_prefix(query: Select[Any], wanted: AuditFilter) -> Select[Any]:
    return (
        query if wanted.prefix is None else query.where(AuditEventRow.action.startswith(wanted.prefix, autoescape=True))
    )


async def _actions(session: DatabaseSession, wanted: AuditFilter) -> Sequence[str]:
    """The actions of this person and drone, by leaps from one to the next in the index."""
    ordered = select(AuditEventRow.action).where(*wanted.subject()).order_by(AuditEventRow.action).limit(1)
    seen = select(ordered.scalar_subquery().label("action")).cte("seen", recursive=True)
    following = ordered.where(AuditEventRow.action > seen.c.action).scalar_subquery()
    seen = seen.union_all(select(following).where(seen.c.action.is_not(None)))
    return (await session.scalars(select(seen.c.action).where(seen.c.action.is_not(None)).limit(MAX_ACTIONS))).all()


def _united(actions: Sequence[str], conditions: Sequence[ColumnElement[bool]], limit: int) -> Select[Any]:
    """The newest of the newest events of each action."""
    branches = []
    for action in actions:
        newest = (
            select(AuditEventRow.id, AuditEventRow.at)
            .where(AuditEventRow.action == action, *conditions)
            .order_by(AuditEventRow.at.desc(), AuditEventRow.id.desc())
            .limit(limit)
            .subquery()
        )
        branches.append(select(newest.c.id, newest.c.at))
    united = union_all(*branches).subquery()
    chosen = select(united.c.id).order_by(united.c.at.desc(), united.c.id.desc()).limit(limit).subquery()
    return (
        select(AuditEventRow)
        .where(AuditEventRow.id.in_(select(chosen.c.id)))
        .order_by(AuditEventRow.at.desc(), AuditEventRow.id.desc())
    )
