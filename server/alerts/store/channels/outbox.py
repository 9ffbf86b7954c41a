"""The outbox of announcements: rows that wait for their channel, taken on by one tower at a time."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final

from sqlalchemy import delete, func, insert, select, update
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.alerts.core.announcer import Announcement, Happening
from server.alerts.core.severity import Severity
from server.alerts.store.channels.tables import AlertChannelRow, AlertDeliveryRow
from server.alerts.store.tables import AlertRow
from server.kernel.access import Action, reaches_all
from server.kernel.people import Principal, Role
from server.storage.in_slices import in_slices
from wire.ids import UserId

AT_ONCE: Final = 20
TAKEN_FOR: Final = timedelta(seconds=90)
"""A tower that has taken a row on and says nothing more is gone by then."""
RETRY_AFTER: Final = tuple(timedelta(seconds=wait) for wait in (10, 30, 120, 600, 1800, 7200, 21600))
"""After each failed attempt; after the last of them it is given up: some nine hours in all."""
KEPT_FOR: Final = timedelta(days=7)
MAX_WAITING: Final = 10_000
"""Rows; with more, new announcements are dropped."""
JUDGED_AT_ONCE: Final = 200
"""Announcements for channels between two turns of the event loop."""
WRITTEN_AT_ONCE: Final = 50
_RANK: Final = {severity: number for number, severity in enumerate(Severity)}

Knows = Callable[[Principal, Announcement], bool]
Owns = Callable[[int, Announcement], bool]


@dataclass(frozen=True, slots=True)
class Taken:
    """A delivery that this tower has taken on, with what is known of its channel and its user."""

    delivery_id: int
    channel_id: int
    kind: str
    target: str
    secret_sealed: str | None
    drones: str
    user: Principal
    happening: str
    content: dict[str, Any]
    attempts: int


def is_wanted(severity: Severity, least: Severity) -> bool:
    """Whether an alert is severe enough for a channel."""
    return _RANK[severity] <= _RANK[least]


async def waiting_by_drone(session: AsyncSession) -> Counter[int | None]:
    """How many rows wait about each drone; None: about the tower."""
    counted = (
        select(AlertRow.drone_id, func.count())
        .select_from(AlertDeliveryRow)
        .outerjoin(AlertRow, AlertRow.id == AlertDeliveryRow.alert_id)
        .where(AlertDeliveryRow.ended_at.is_(None))
        .group_by(AlertRow.drone_id)
    )
    return Counter({row[0]: row[1] for row in await session.execute(counted)})


async def put(
    session: AsyncSession,
    announcements: Iterable[tuple[Announcement, dict[str, Any]]],
    *,
    knows: Knows,
    owns: Owns,
    now: datetime,
    of_a_drone: int,
) -> int:
    """Writes one row for each channel that gets an announcement; the end of an alert goes where its beginning went.
    `of_a_drone`: rows about one drone that may wait: however much it announces, the others' find room. Returns how many
    were dropped for lack of room. In `Database.writing()`; raises IntegrityError if another tower writes the same ones.

    All drones may announce something at once, to everybody's channels: frames pass between the slices.
    """
    query = (
        select(AlertChannelRow, UserRow)
        .join(UserRow, UserRow.id == AlertChannelRow.user_id)
        .where(AlertChannelRow.code_hash.is_(None), UserRow.disabled.is_(False))
    )
    channels = await in_slices(session, query)
    if not channels:
        return 0
    wanted = []
    judged = 0
    for announcement, content in announcements:
        for channel, user in channels:
            if _gets(channel, user, announcement, knows, owns):
                wanted.append((channel.id, announcement, content))
            judged += 1
            if judged % JUDGED_AT_ONCE == 0:
                await asyncio.sleep(0)
    if not wanted:
        return 0
    ids = {announcement.alert.id for _, announcement, _ in wanted}
    there = select(AlertDeliveryRow.channel_id, AlertDeliveryRow.alert_id, AlertDeliveryRow.happening)
    known = {tuple(row) for row in await session.execute(there.where(AlertDeliveryRow.alert_id.in_(ids)))}
    waiting = await waiting_by_drone(session)
    room = MAX_WAITING - waiting.total()
    dropped = 0
    # In order, so that a beginning of this very batch counts for its end.
    new: list[tuple[int, Announcement, dict[str, Any]]] = []
    for number, (channel_id, announcement, content) in enumerate(wanted):
        if number % JUDGED_AT_ONCE == 0:
            await asyncio.sleep(0)
        happening, alert_id = announcement.happening, announcement.alert.id
        is_told = (channel_id, alert_id, Happening.OPENED.value) in known
        if (channel_id, alert_id, happening.value) in known or (happening is Happening.CLOSED and not is_told):
            continue
        known.add((channel_id, alert_id, happening.value))
        whose = announcement.alert.drone_id
        if len(new) >= room or (whose is not None and waiting[whose] >= of_a_drone):
            dropped += 1
            continue
        waiting[whose] += 1
        new.append((channel_id, announcement, content))
    for first in range(0, len(new), WRITTEN_AT_ONCE):
        # Not as objects: four hundred of them kept every frame waiting for 35 ms, and their JSON in one piece for 50.
        await session.execute(
            insert(AlertDeliveryRow),
            [
                {
                    "channel_id": channel_id,
                    "alert_id": announcement.alert.id,
                    "happening": announcement.happening.value,
                    "content": content,
                    "created_at": now,
                    "due_at": now,
                }
                for channel_id, announcement, content in new[first : first + WRITTEN_AT_ONCE]
            ],
        )
    return dropped


def _gets(channel: AlertChannelRow, user: UserRow, announcement: Announcement, knows: Knows, owns: Owns) -> bool:
    if announcement.happening is Happening.UNANSWERED and not reaches_all(Role(user.role), Action.COMMAND):
        return False
    if not is_wanted(announcement.alert.rule.severity, Severity(channel.severity)):
        return False
    if channel.drones == "own" and not owns(user.id, announcement):
        return False
    return knows(principal_of(user), announcement)


def principal_of(user: UserRow) -> Principal:
    """The user as one who reads, without a session."""
    return Principal(UserId(user.id), user.name, Role(user.role), 0, user.created_at)


async def take(
    session: AsyncSession, now: datetime, *, room: int, busy_channels: Collection[int], full_users: Collection[int]
) -> tuple[list[Taken], int]:
    """Takes on what is due, one delivery of each user, and returns how many were forgotten on the way: those of
    disabled users, and those that the alert itself has overtaken. In `Database.writing()`."""
    due = (AlertDeliveryRow.ended_at.is_(None), AlertDeliveryRow.due_at <= now)
    query = (
        select(AlertDeliveryRow, AlertChannelRow, UserRow, AlertRow)
        .join(AlertChannelRow, AlertChannelRow.id == AlertDeliveryRow.channel_id)
        .join(UserRow, UserRow.id == AlertChannelRow.user_id)
        .outerjoin(AlertRow, AlertRow.id == AlertDeliveryRow.alert_id)
        .where(*due, AlertChannelRow.id.not_in(busy_channels), UserRow.id.not_in(full_users))
        .order_by(AlertDeliveryRow.due_at, AlertDeliveryRow.id)
        .limit(AT_ONCE)
    )
    taken: list[Taken] = []
    forgotten = 0
    users: set[int] = set()
    for row, channel, user, alert in (await session.execute(query)).all():
        if user.disabled or _is_overtaken(row, user, alert):
            await session.delete(row)
            forgotten += 1
            continue
        if user.id in users or len(taken) == room:
            continue
        mine = update(AlertDeliveryRow).where(AlertDeliveryRow.id == row.id, *due).values(due_at=now + TAKEN_FOR)
        result = await session.execute(mine, execution_options={"synchronize_session": False})
        if result.rowcount != 1:  # type: ignore[attr-defined]
            continue  # another tower was faster
        users.add(user.id)
        taken.append(
            Taken(
                row.id,
                channel.id,
                channel.kind,
                channel.target,
                channel.secret_sealed,
                channel.drones,
                principal_of(user),
                row.happening,
                row.content,
                row.attempts,
            )
        )
    return taken, forgotten


def _is_overtaken(row: AlertDeliveryRow, user: UserRow, alert: AlertRow | None) -> bool:
    """Whether it is no news any more: a late `opened` after the end, `unanswered` after an answer, or of one who is no
    admin now."""
    is_over = alert is not None and alert.closed_at is not None
    if row.happening == Happening.OPENED.value:
        return is_over and row.attempts > 0
    if row.happening != Happening.UNANSWERED.value:
        return False
    is_answered = alert is not None and alert.acknowledged_at is not None
    return is_over or is_answered or not reaches_all(Role(user.role), Action.COMMAND)


async def sent(session: AsyncSession, one: Taken, now: datetime) -> None:
    """In `Database.writing()`."""
    await _note(session, one, now, ended_at=now, problem="", sent_at=now)


async def failed(session: AsyncSession, one: Taken, problem: str, now: datetime) -> bool:
    """Returns whether it is given up. In `Database.writing()`."""
    is_over = one.attempts >= len(RETRY_AFTER)
    due_at = now if is_over else now + RETRY_AFTER[one.attempts]
    await _note(session, one, now, ended_at=now if is_over else None, problem=problem[:200], due_at=due_at)
    return is_over


async def forget(session: AsyncSession, one: Taken) -> None:
    """Its user may not know of it any more. In `Database.writing()`."""
    await session.execute(delete(AlertDeliveryRow).where(AlertDeliveryRow.id == one.delivery_id))


async def _note(
    session: AsyncSession,
    one: Taken,
    now: datetime,
    *,
    ended_at: datetime | None,
    problem: str,
    sent_at: datetime | None = None,
    due_at: datetime | None = None,
) -> None:
    of_delivery: dict[str, Any] = {"ended_at": ended_at, "problem": problem, "attempts": one.attempts + 1}
    of_channel: dict[str, Any] = {"problem": problem}
    if due_at is not None:
        of_delivery["due_at"] = due_at
    if sent_at is not None:
        of_channel["sent_at"] = sent_at
    await session.execute(update(AlertDeliveryRow).where(AlertDeliveryRow.id == one.delivery_id).values(**of_delivery))
    await session.execute(update(AlertChannelRow).where(AlertChannelRow.id == one.channel_id).values(**of_channel))


async def next_due(session: AsyncSession) -> datetime | None:
    """When something is due next; None: nothing waits."""
    waits = select(func.min(AlertDeliveryRow.due_at)).where(AlertDeliveryRow.ended_at.is_(None))
    found: datetime | None = await session.scalar(waits)
    return found


async def tidy(session: AsyncSession, now: datetime) -> None:
    """Deletes what ended long ago. In `Database.writing()`."""
    await session.execute(delete(AlertDeliveryRow).where(AlertDeliveryRow.ended_at < now - KEPT_FOR))


def rows_waiting(channel_ids: Sequence[int]) -> Any:
    """A query of (channel, number of deliveries that wait)."""
    return (
        select(AlertDeliveryRow.channel_id, func.count())
        .where(AlertDeliveryRow.channel_id.in_(channel_ids), AlertDeliveryRow.ended_at.is_(None))
        .group_by(AlertDeliveryRow.channel_id)
    )
