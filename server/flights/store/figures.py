"""The rows of flights' figures. Every function takes a session."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, datetime, timedelta
from typing import Any, Final

from sqlalchemy import delete, exists, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.flights.core.figures import FlightFigures, PilotShare
from server.flights.core.statistics import KeptFlight
from server.flights.core.times import microseconds
from server.flights.store.tables import FlightFiguresRow, FlightRow, FlightShareRow
from server.storage.in_slices import in_slices

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_NOT_COLUMNS: Final = ("began_us", "ended_us", "pilots")
READY: Final = "ready"
FLIGHTS_A_QUERY: Final = 50
"""With their pilots, a millisecond or two of the event loop."""


async def keep_figures(session: AsyncSession, *, flight_id: int, drone_id: int, figures: FlightFigures) -> None:
    """Replaces what was kept of this flight. In `Database.writing()`."""
    await session.execute(delete(FlightShareRow).where(FlightShareRow.flight_id == flight_id))
    await session.execute(delete(FlightFiguresRow).where(FlightFiguresRow.flight_id == flight_id))
    values: dict[str, Any] = {
        one.name: _rounded(getattr(figures, one.name)) for one in fields(figures) if one.name not in _NOT_COLUMNS
    }
    began_at, ended_at = (_EPOCH + timedelta(microseconds=at) for at in (figures.began_us, figures.ended_us))
    session.add(
        FlightFiguresRow(
            flight_id=flight_id,
            drone_id=drone_id,
            began_at=began_at,
            ended_at=ended_at,
            flown_s=round(figures.flown_s, 3),
            **values,
        )
    )
    await session.flush()
    ids = [one.user_id for one in figures.pilots if one.user_id is not None]
    there = set(await session.scalars(select(UserRow.id).where(UserRow.id.in_(ids))))  # deleted ones keep their name
    for number, share in enumerate(figures.pilots):
        session.add(
            FlightShareRow(
                flight_id=flight_id,
                number=number,
                user_id=share.user_id if share.user_id in there else None,
                name=share.name[:64],
                held_s=round(share.held_s, 3),
                air_s=_rounded(share.air_s),
                distance_m=round(share.distance_m, 1),
                landings=share.landings,
            )
        )


@dataclass(frozen=True)
class FiguresQuery:
    """Which flights, as `began_at` says; `user_id`: those in which this user had the controls."""

    drone_ids: Collection[int]
    since: datetime | None = None
    until: datetime | None = None
    user_id: int | None = None
    flight_id: int | None = None


async def kept_flights(session: AsyncSession, query: FiguresQuery, limit: int) -> list[KeptFlight]:
    """Newest first."""
    statement = select(FlightFiguresRow).where(FlightFiguresRow.drone_id.in_(query.drone_ids))
    if query.since is not None:
        statement = statement.where(FlightFiguresRow.began_at >= query.since)
    if query.until is not None:
        statement = statement.where(FlightFiguresRow.began_at < query.until)
    if query.flight_id is not None:
        statement = statement.where(FlightFiguresRow.flight_id == query.flight_id)
    if query.user_id is not None:
        flown = select(FlightShareRow.flight_id).where(FlightShareRow.user_id == query.user_id)
        statement = statement.where(FlightFiguresRow.flight_id.in_(flown))
    newest = FlightFiguresRow.began_at.desc(), FlightFiguresRow.flight_id.desc()
    rows = [row for (row,) in await in_slices(session, statement.order_by(*newest).limit(limit))]
    kept: list[KeptFlight] = []
    for begin in range(0, len(rows), FLIGHTS_A_QUERY):
        some = rows[begin : begin + FLIGHTS_A_QUERY]
        shares = await _shares(session, [row.flight_id for row in some])
        kept += [_kept(row, shares.get(row.flight_id, [])) for row in some]
    return kept


async def _shares(session: AsyncSession, flight_ids: Sequence[int]) -> dict[int, list[PilotShare]]:
    ordered = select(FlightShareRow).where(FlightShareRow.flight_id.in_(flight_ids))
    shares: dict[int, list[PilotShare]] = {}
    for one in await session.scalars(ordered.order_by(FlightShareRow.flight_id, FlightShareRow.number)):
        share = PilotShare(one.user_id, one.name, one.held_s, one.air_s, one.distance_m, one.landings)
        shares.setdefault(one.flight_id, []).append(share)
    return shares


def _kept(row: FlightFiguresRow, shares: Sequence[PilotShare]) -> KeptFlight:
    values = {one.name: getattr(row, one.name) for one in fields(FlightFigures) if one.name not in _NOT_COLUMNS}
    figures = FlightFigures(
        began_us=microseconds(row.began_at), ended_us=microseconds(row.ended_at), pilots=tuple(shares), **values
    )
    return KeptFlight(row.flight_id, row.drone_id, row.began_at, figures)


async def without_figures(session: AsyncSession, store: str, *, above: int) -> FlightRow | None:
    """Returns the next flight of this folder that is over and has none, by id."""
    query = select(FlightRow).where(
        FlightRow.store == store,
        FlightRow.state == READY,
        FlightRow.id > above,
        ~exists().where(FlightFiguresRow.flight_id == FlightRow.id),
    )
    return await session.scalar(query.order_by(FlightRow.id).limit(1))


def _rounded(value: float | None) -> float | None:
    return round(value, 3) if isinstance(value, float) else value
