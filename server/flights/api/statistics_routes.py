"""`/api/v1/statistics`, `/api/v1/log-book` and the figures of a flight: as JSON, and as CSV for spreadsheets.

Who may read a flight may read its figures, and no one else: the rules are those of `server/flights/api/readable.py`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Path, Query, Response
from pydantic import AwareDatetime, BaseModel, Field

from server.flights.api.readable import known_flight, readable_drones
from server.flights.core.refusals import FlightElsewhere, FlightRunning, UnknownFlight
from server.flights.core.statistics import KeptFlight, LogBookView, StatisticsView, log_book, statistics
from server.flights.core.statistics_csv import drones_csv, flights_csv, log_book_csv, pilots_csv
from server.flights.core.views import PilotView
from server.flights.store import catalogue
from server.flights.store.figures import FiguresQuery, kept_flights
from server.http.access import Viewer
from server.http.dependencies import DatabaseDep, FlightsDep, HubDep
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.people import Principal
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.core.refusals import OnlyWatches, ViewTaken
from server.storage.database import Database

router = APIRouter(prefix="/api/v1", tags=["flights"], responses=answers(NotSignedIn, SessionExpired))

CSV_TYPE: Final = "text/csv"
MAX_FLIGHTS: Final = 10_000
"""Of one answer: some years of a busy squad."""
DroneId = Annotated[int | None, Query(ge=1, le=0xFFFFFFFF, description="Of this drone only")]
Since = Annotated[AwareDatetime | None, Query(description="Of flights begun then or later")]
Until = Annotated[AwareDatetime | None, Query(description="Of flights begun before then")]
CSV_ANSWER: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {CSV_TYPE: {}}, "description": "A table with a line of names"}
}


class ShareView(BaseModel):
    """One person's part in a flight."""

    pilot: PilotView
    held_s: Annotated[float, Field(description="With the controls")]
    air_s: Annotated[float | None, Field(description="Of it in the air")]
    distance_m: float
    landings: int


class FlightFiguresView(BaseModel):
    """The figures of one flight; null: not known."""

    flight_id: int
    duration_s: Annotated[float, Field(description="From arming to disarming")]
    air_s: Annotated[float | None, Field(description="In the air")]
    distance_m: Annotated[float, Field(description="Over ground")]
    max_height_m: Annotated[float | None, Field(description="Above home")]
    max_speed_m_s: Annotated[float | None, Field(description="Over ground")]
    battery_start_v: float | None
    battery_end_v: float | None
    used_mah: Annotated[float | None, Field(description="As the autopilot counted, else its current summed up")]
    landings: int
    holds: int
    hand_overs: int
    alerts: int
    critical_alerts: int
    link_losses: int
    link_lost_s: float
    rtt_mean_ms: float | None
    rtt_max_ms: float | None
    loss_mean: Annotated[float | None, Field(description="0 to 1")]
    pilots: list[ShareView]


@router.get("/flights/{flight_id}/figures", responses=answers(UnknownFlight, FlightRunning, FlightElsewhere))
async def get_flight_figures(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    flights: FlightsDep,
    flight_id: Annotated[int, Path(ge=1, le=2**31 - 1)],
) -> FlightFiguresView:
    """Returns what the flight took and what happened, in figures. Those of a flight that an older tower recorded are
    computed now."""
    row, _ = await known_flight(hub, database, principal, flight_id)
    query = FiguresQuery([row.drone_id], flight_id=flight_id)
    async with database.reading() as session:
        found = await kept_flights(session, query, 1)
    if not found:
        if row.state == catalogue.RUNNING:
            raise FlightRunning
        if row.store != flights.files.id:
            raise FlightElsewhere
        try:
            async with flights.export_turns:
                await flights.service.figure_out(row)
        except (OSError, ValueError):
            raise UnknownFlight from None  # its files cannot be read
        async with database.reading() as session:
            found = await kept_flights(session, query, 1)
        if not found:
            raise UnknownFlight
    return _figures_view(found[0])


@router.get("/statistics", responses=answers(UnknownDrone, ViewTaken, OnlyWatches))
async def get_statistics(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    drone_id: DroneId = None,
    since: Since = None,
    until: Until = None,
) -> StatisticsView:
    """Sums up the flights that the user may read: by drone, by pilot, and by month."""
    drones = readable_drones(hub, principal, drone_id)
    found, is_whole = await _flights(database, principal, drones, since, until)
    return await asyncio.to_thread(statistics, found, _names(drones), is_whole=is_whole)


@router.get(
    "/statistics/csv", response_class=Response, responses=CSV_ANSWER | answers(UnknownDrone, ViewTaken, OnlyWatches)
)
async def download_statistics(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    by: Annotated[Literal["drones", "pilots", "flights"], Query(description="What has a row")] = "drones",
    drone_id: DroneId = None,
    since: Since = None,
    until: Until = None,
) -> Response:
    """Downloads the same as CSV: a row for each drone, each pilot, or each flight with its figures."""
    drones = readable_drones(hub, principal, drone_id)
    found, is_whole = await _flights(database, principal, drones, since, until)

    def made() -> str:
        if by == "flights":
            return flights_csv(found, _names(drones))
        view = statistics(found, _names(drones), is_whole=is_whole)
        return drones_csv(view) if by == "drones" else pilots_csv(view)

    return csv_download(await asyncio.to_thread(made), f"statistics-{by}")


@router.get("/log-book")
async def get_log_book(
    principal: Viewer, hub: HubDep, database: DatabaseDep, since: Since = None, until: Until = None
) -> LogBookView:
    """Returns one's own log book: the flights in which one had the controls, of drones whose flights one may read."""
    return await _log_book(hub, database, principal, since, until)


@router.get("/log-book/csv", response_class=Response, responses=CSV_ANSWER)
async def download_log_book(
    principal: Viewer, hub: HubDep, database: DatabaseDep, since: Since = None, until: Until = None
) -> Response:
    """Downloads the same as CSV."""
    return csv_download(log_book_csv(await _log_book(hub, database, principal, since, until)), "log-book")


async def _log_book(
    hub: Hub, database: Database, principal: Principal, since: datetime | None, until: datetime | None
) -> LogBookView:
    drones = readable_drones(hub, principal)
    found, is_whole = await _flights(database, principal, drones, since, until, user_id=principal.user_id)
    return await asyncio.to_thread(log_book, found, principal.user_id, _names(drones), is_whole=is_whole)


async def _flights(
    database: Database,
    principal: Principal,
    drones: dict[int, LiveDrone],
    since: datetime | None,
    until: datetime | None,
    *,
    user_id: int | None = None,
) -> tuple[Sequence[KeptFlight], bool]:
    """Returns the flights of these drones that the user may know of, newest first, and whether these are all."""
    if not drones:
        return [], True
    query = FiguresQuery(list(drones), since, until, user_id)
    async with database.reading() as session:
        found = await kept_flights(session, query, MAX_FLIGHTS + 1)
    known = [
        one
        for one in found[:MAX_FLIGHTS]
        if drones[one.drone_id].knows_of(principal.user_id, principal.role, one.began_at)
    ]
    return known, len(found) <= MAX_FLIGHTS


def _names(drones: dict[int, LiveDrone]) -> dict[int, str]:
    return {drone_id: drone.record.name for drone_id, drone in drones.items()}


def csv_download(text: str, name: str) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}.csv"', "Cache-Control": "private, no-cache"}
    return Response(text, media_type=CSV_TYPE, headers=headers)


def _figures_view(flight: KeptFlight) -> FlightFiguresView:
    figures = flight.figures
    about = {name: getattr(figures, name) for name in FlightFiguresView.model_fields if hasattr(figures, name)}
    pilots = [
        {
            "pilot": PilotView(id=one.user_id, name=one.name),
            "held_s": one.held_s,
            "air_s": one.air_s,
            "distance_m": one.distance_m,
            "landings": one.landings,
        }
        for one in figures.pilots
    ]
    return FlightFiguresView.model_validate(about | {"flight_id": flight.flight_id, "pilots": pilots})
