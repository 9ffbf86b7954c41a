"""The database rows of flights. Every function takes a session; a change and its audit record are committed
together."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Final

from sqlalchemy import Select, and_, delete, exists, func, or_, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.audit.store.action import AuditAction
from server.flights.core.index import Pilot
from server.flights.core.refusals import FlightRunning, UnknownFlight
from server.flights.core.views import FlightView, PilotView
from server.flights.store.figures import keep_figures
from server.flights.store.files import FlightFacts
from server.flights.store.tables import FlightPilotRow, FlightRow
from server.kernel.names import name_key
from server.storage.in_slices import in_slices

RUNNING: Final = "recording"
READY: Final = "ready"
FAILED: Final = "failed"
OVERHEAD_BYTES: Final = 8192
"""What a flight takes beside its content: two files and some rows. A thousand empty flights are not for nothing."""
TRACKS_AT_ONCE: Final = 25
"""Rows that are read in one go: each has a track of 200 places."""
_MAX_TEXT_LENGTH: Final = 200
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_US: Final = timedelta(microseconds=1)


@dataclass(frozen=True)
class Query:
    """Which flights. `since`, `until`: they began then; `before`: after these in the list (`cursor_of`)."""

    drone_ids: Collection[int]
    pilot: str = ""
    since: datetime | None = None
    until: datetime | None = None
    before: tuple[datetime, int] | None = None


def cursor_of(row: FlightRow) -> str:
    """For `read_cursor`."""
    return f"{(row.began_at - _EPOCH) // _US}-{row.id}"


def read_cursor(text: str) -> tuple[datetime, int]:
    """Raises ValueError, OverflowError."""
    at_us, _, flight_id = text.partition("-")
    number = int(flight_id)
    if not 0 < number < 2**31:
        raise ValueError("no id")
    return _EPOCH + timedelta(microseconds=int(at_us)), number


async def search(session: AsyncSession, query: Query, limit: int) -> Sequence[FlightRow]:
    """Newest first."""
    statement: Select[FlightRow] = select(FlightRow).where(FlightRow.drone_id.in_(query.drone_ids))
    if query.pilot:
        flown_by = and_(FlightPilotRow.flight_id == FlightRow.id, FlightPilotRow.name_key == name_key(query.pilot))
        statement = statement.where(exists().where(flown_by))
    if query.since is not None:
        statement = statement.where(FlightRow.began_at >= query.since)
    if query.until is not None:
        statement = statement.where(FlightRow.began_at < query.until)
    if query.before is not None:
        at, flight_id = query.before
        earlier = or_(FlightRow.began_at < at, and_(FlightRow.began_at == at, FlightRow.id < flight_id))
        statement = statement.where(FlightRow.began_at <= at, earlier)
    statement = statement.order_by(FlightRow.began_at.desc(), FlightRow.id.desc()).limit(limit)
    return [row for (row,) in await in_slices(session, statement, rows=TRACKS_AT_ONCE)]


async def get(session: AsyncSession, flight_id: int) -> FlightRow:
    """Raises UnknownFlight."""
    row = await session.get(FlightRow, flight_id)
    if row is None:
        raise UnknownFlight
    return row


async def pilots_of(session: AsyncSession, flight_ids: Collection[int]) -> dict[int, list[PilotView]]:
    """By flight, in the order in which they flew."""
    query = select(FlightPilotRow).where(FlightPilotRow.flight_id.in_(flight_ids))
    found: dict[int, list[PilotView]] = {}
    for row in await session.scalars(query.order_by(FlightPilotRow.flight_id, FlightPilotRow.number)):
        found.setdefault(row.flight_id, []).append(PilotView(id=row.user_id, name=row.name))
    return found


async def add(
    session: AsyncSession, *, drone_id: int, store: str, file: str, began_at: datetime, pilots: Sequence[Pilot]
) -> FlightRow:
    """A flight that is being recorded. Whoever calls knows that the drone exists."""
    row = FlightRow(
        drone_id=drone_id,
        store=store,
        file=file,
        state=RUNNING,
        words="",
        began_at=began_at,
        frames=0,
        lost_frames=0,
        size_bytes=0,
        track=[],
    )
    session.add(row)
    await session.flush()
    if pilots:  # a new row has none
        await _set_pilots(session, row.id, pilots)
    return row


async def finish(session: AsyncSession, row: FlightRow, facts: FlightFacts, *, words: str, lost_frames: int) -> None:
    """Everything is on the disk."""
    summary, index = facts.summary, facts.index
    ended_us = index.ended_us or summary.last_us or index.began_us
    row.state, row.words = READY, words[:_MAX_TEXT_LENGTH]
    row.ended_at = _EPOCH + timedelta(microseconds=max(ended_us, index.began_us))
    row.frames, row.lost_frames, row.size_bytes = summary.frames, lost_frames, facts.size_bytes
    row.distance_m, row.max_height_m = round(summary.distance_m, 1), summary.max_height_m
    row.track = [[round(lat, 6), round(lon, 6)] for lat, lon in summary.track]
    await _set_pilots(session, row.id, index.pilots)
    await keep_figures(session, flight_id=row.id, drone_id=row.drone_id, figures=facts.figures)


def fail(row: FlightRow, words: str, at: datetime) -> None:
    """Its files cannot be read now. The next start tries again."""
    row.state, row.words, row.ended_at = FAILED, words[:_MAX_TEXT_LENGTH], at


async def _set_pilots(session: AsyncSession, flight_id: int, pilots: Sequence[Pilot]) -> None:
    ids = [one.user_id for one in pilots if one.user_id is not None]
    there = set(await session.scalars(select(UserRow.id).where(UserRow.id.in_(ids))))  # deleted ones keep their name
    await session.execute(delete(FlightPilotRow).where(FlightPilotRow.flight_id == flight_id))
    for number, one in enumerate(pilots):
        name = one.name[:64]
        user_id = one.user_id if one.user_id in there else None
        key = name_key(name)
        session.add(FlightPilotRow(flight_id=flight_id, number=number, user_id=user_id, name=name, name_key=key))


async def by_file(session: AsyncSession, file: str) -> FlightRow | None:
    return await session.scalar(select(FlightRow).where(FlightRow.file == file))


async def ids_by_file(session: AsyncSession, files: Collection[str]) -> dict[str, int]:
    """Those that there are."""
    query = select(FlightRow.file, FlightRow.id).where(FlightRow.file.in_(files))
    return {row.file: row.id for row in await session.execute(query)}


async def files_of_store(session: AsyncSession, store: str) -> dict[str, tuple[int, str]]:
    """Returns drone and state of each flight, by file."""
    query = select(FlightRow.file, FlightRow.drone_id, FlightRow.state).where(FlightRow.store == store)
    return {file: (drone_id, state) for file, drone_id, state in await session.execute(query)}


async def bytes_over(session: AsyncSession, store: str) -> dict[int, int]:
    """Returns the bytes of flights that are over, by drone."""
    total = func.sum(FlightRow.size_bytes + OVERHEAD_BYTES)
    query = select(FlightRow.drone_id, total).where(FlightRow.store == store, FlightRow.state != RUNNING)
    return {drone_id: int(size) for drone_id, size in await session.execute(query.group_by(FlightRow.drone_id))}


async def oldest_over(session: AsyncSession, store: str, drone_ids: Iterable[int], most: int) -> Sequence[FlightRow]:
    query = select(FlightRow).where(
        FlightRow.store == store, FlightRow.state != RUNNING, FlightRow.drone_id.in_(list(drone_ids))
    )
    return (await session.scalars(query.order_by(FlightRow.began_at, FlightRow.id).limit(most))).all()


async def over_before(session: AsyncSession, store: str, before: datetime, most: int) -> Sequence[FlightRow]:
    query = select(FlightRow).where(FlightRow.store == store, FlightRow.state != RUNNING, FlightRow.began_at < before)
    return (await session.scalars(query.order_by(FlightRow.began_at, FlightRow.id).limit(most))).all()


async def remove(session: AsyncSession, flight_id: int, event: str, action: AuditAction) -> FlightRow:
    """`event`: `flight.deleted` by a person, `flight.removed` for its age or to make room. Raises UnknownFlight,
    FlightRunning."""
    row = await session.scalar(select(FlightRow).where(FlightRow.id == flight_id).with_for_update())
    if row is None:
        raise UnknownFlight
    if row.state == RUNNING:
        raise FlightRunning
    about = {"flight": row.id, "began_at": row.began_at.isoformat(), "frames": row.frames}
    action.record(session, event, drone_id=row.drone_id, **about)
    await session.delete(row)
    return row


def view_of(row: FlightRow, drone: str, pilots: Sequence[PilotView]) -> FlightView:
    """Returns the external view. `drone`: its name now."""
    duration_s = None if row.ended_at is None else (row.ended_at - row.began_at).total_seconds()
    return FlightView.model_validate(
        {
            "id": row.id,
            "drone_id": row.drone_id,
            "drone": drone,
            "pilots": list(pilots),
            "state": row.state,
            "words": row.words,
            "began_at": row.began_at,
            "ended_at": row.ended_at,
            "duration_s": duration_s,
            "distance_m": row.distance_m,
            "max_height_m": row.max_height_m,
            "track": row.track,
            "frames": row.frames,
            "lost_frames": row.lost_frames,
            "size_bytes": row.size_bytes,
        }
    )
