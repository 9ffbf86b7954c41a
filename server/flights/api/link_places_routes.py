"""`/api/v1/statistics/link-quality`: how good the link was where, as GeoJSON and as CSV.

It is read from the indices of flights, which have positions: who may read those flights may read it, and what is
removed with them is not in it any more.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from typing import Annotated, Final

from fastapi import APIRouter, Query, Response

from server.flights.api.readable import readable_drones
from server.flights.api.statistics_routes import CSV_ANSWER, DroneId, Since, Until, csv_download
from server.flights.core.link_places import LinkPlaces, LinkPlacesView, link_places_csv
from server.flights.store import catalogue
from server.flights.store.files import FlightFiles
from server.flights.store.flights import Flights
from server.flights.store.tables import FlightRow
from server.http.access import Viewer
from server.http.dependencies import DatabaseDep, FlightsDep, HubDep
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.people import Principal
from server.live.hub import Hub
from server.operations.core.refusals import OnlyWatches, ViewTaken
from server.storage.database import Database

router = APIRouter(prefix="/api/v1", tags=["flights"], responses=answers(NotSignedIn, SessionExpired))

MAX_FLIGHTS: Final = 500
MAX_BYTES: Final = 64 * 1024 * 1024
"""Of indices that one answer reads: an hour of flight is some 300 kB."""
TURN_S: Final = 0.001
CellM = Annotated[float, Query(ge=20, le=5000, description="The side of a cell")]
_REFUSALS: Final = answers(UnknownDrone, ViewTaken, OnlyWatches)


@router.get("/statistics/link-quality", responses=_REFUSALS)
async def get_link_quality(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    flights: FlightsDep,
    drone_id: DroneId = None,
    since: Since = None,
    until: Until = None,
    cell_m: CellM = 100.0,
) -> LinkPlacesView:
    """Returns the quality of links by place, as GeoJSON: round trip, loss, and how often the link was lost."""
    rows, is_whole = await _rows(hub, database, principal, (drone_id, since, until))
    return await _places(flights, rows, cell_m, is_whole=is_whole)


@router.get("/statistics/link-quality/csv", response_class=Response, responses=CSV_ANSWER | _REFUSALS)
async def download_link_quality(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    flights: FlightsDep,
    drone_id: DroneId = None,
    since: Since = None,
    until: Until = None,
    cell_m: CellM = 100.0,
) -> Response:
    """Downloads the same as CSV: a row for each cell."""
    rows, is_whole = await _rows(hub, database, principal, (drone_id, since, until))
    return csv_download(link_places_csv(await _places(flights, rows, cell_m, is_whole=is_whole)), "link-quality")


async def _rows(
    hub: Hub, database: Database, principal: Principal, asked: tuple[DroneId, Since, Until]
) -> tuple[Sequence[FlightRow], bool]:
    """Flights that are over and that the user may read, newest first, and whether these are all."""
    drone_id, since, until = asked
    drones = readable_drones(hub, principal, drone_id)
    if not drones:
        return [], True
    async with database.reading() as session:
        found = await catalogue.search(
            session, catalogue.Query(list(drones), since=since, until=until), MAX_FLIGHTS + 1
        )
    known = [
        row
        for row in found[:MAX_FLIGHTS]
        if row.state == catalogue.READY
        and drones[row.drone_id].knows_of(principal.user_id, principal.role, row.began_at)
    ]
    return known, len(found) <= MAX_FLIGHTS


async def _places(flights: Flights, rows: Sequence[FlightRow], cell_m: float, *, is_whole: bool) -> LinkPlacesView:
    here = [(row.drone_id, row.file) for row in rows if row.store == flights.files.id]
    async with flights.export_turns:
        view = await asyncio.to_thread(_read, flights.files, here, cell_m)
    view.is_whole = view.is_whole and is_whole and len(here) == len(rows)
    return view


def _read(files: FlightFiles, here: Sequence[tuple[int, str]], cell_m: float) -> LinkPlacesView:
    """Blocking. Lets the tower's loop go first."""
    places, left = LinkPlaces(cell_m), MAX_BYTES
    for drone_id, file in here:
        try:
            lines = files.read_index(drone_id, file)
        except OSError:
            continue  # it went in this moment
        left -= sum(map(len, lines))
        if left < 0:
            places.is_whole = False
            break
        places.take(lines)
        time.sleep(TURN_S)
    return places.view()
