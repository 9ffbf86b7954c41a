"""`/api/v1/flights`: recorded flights, their index, their files, and the same in formats of other programs."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from pathlib import Path as FilePath
from typing import Annotated, Final
from urllib.parse import quote

from fastapi import APIRouter, Path, Query, Response
from fastapi.responses import FileResponse, StreamingResponse
from pydantic import AwareDatetime

from server.flights.api.export_stream import FORMATS, FormatName, export_stream
from server.flights.api.readable import known_flight, readable_drones
from server.flights.core.refusals import BadPage, FlightElsewhere, FlightRunning, UnknownFlight
from server.flights.core.report import report
from server.flights.core.views import FlightDetailView, FlightPageView, FlightVideoView
from server.flights.store import catalogue
from server.flights.store.files import TLOG
from server.flights.store.flights import Flights
from server.flights.store.index_document import detail_document, index_entries
from server.flights.store.tables import FlightRow
from server.http.access import Admin, Viewer
from server.http.dependencies import AuditDep, DatabaseDep, FlightsDep, HubDep
from server.http.problem_docs import answers
from server.kernel.access import UnknownDrone
from server.kernel.names import is_name
from server.kernel.people import Principal
from server.live.live_drone import LiveDrone
from server.operations.core.refusals import OnlyWatches, ViewTaken
from server.video.store import catalogue as recordings_catalogue
from server.video.store.tables import RecordingRow

router = APIRouter(prefix="/api/v1/flights", tags=["flights"])

TLOG_TYPE: Final = "application/octet-stream"
REPORT_TYPE: Final = "text/html"
MAX_PAGE: Final = 100
PAGE: Final = 50
MAX_LOOKS: Final = 10
"""Pages of rows that are read for one answer, where most are of a time that the user may not know of."""
MAX_NAME: Final = 64
FlightPath = Annotated[int, Path(ge=1, le=2**31 - 1)]
_ONE: Final = (UnknownFlight,)
_FILE: Final = (UnknownFlight, FlightRunning, FlightElsewhere)


@router.get("", responses=answers(UnknownDrone, ViewTaken, OnlyWatches, BadPage))
async def list_flights(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    drone_id: Annotated[int | None, Query(ge=1, le=0xFFFFFFFF, description="Of this drone only")] = None,
    pilot: Annotated[str, Query(max_length=MAX_NAME, description="Name of somebody who had the controls")] = "",
    since: Annotated[AwareDatetime | None, Query(description="Begun then or later")] = None,
    until: Annotated[AwareDatetime | None, Query(description="Begun before then")] = None,
    before: Annotated[str | None, Query(max_length=40, description="`next` of the page before")] = None,
    limit: Annotated[int, Query(ge=1, le=MAX_PAGE)] = PAGE,
) -> FlightPageView:
    """Lists flights of the drones whose files the user may read, newest first."""
    drones = readable_drones(hub, principal, drone_id)
    cursor = None
    if before is not None:
        try:
            cursor = catalogue.read_cursor(before)
        except (ValueError, OverflowError):
            raise BadPage from None
    rows: list[FlightRow] = []
    is_more = bool(drones) and (not pilot.strip() or is_name(pilot))
    last: FlightRow | None = None
    async with database.reading() as session:
        for _ in range(MAX_LOOKS):
            if not is_more or len(rows) >= limit:
                break
            query = catalogue.Query(list(drones), pilot.strip(), since, until, cursor)
            found = await catalogue.search(session, query, limit + 1 - len(rows))
            is_more = len(found) > limit - len(rows)
            for row in found[: limit - len(rows)]:
                last, cursor = row, (row.began_at, row.id)
                if drones[row.drone_id].knows_of(principal.user_id, principal.role, row.began_at):
                    rows.append(row)
        pilots = await catalogue.pilots_of(session, [row.id for row in rows])
    return FlightPageView(
        flights=[catalogue.view_of(row, drones[row.drone_id].record.name, pilots.get(row.id, [])) for row in rows],
        next=catalogue.cursor_of(last) if is_more and last is not None else None,
    )


@router.get("/{flight_id}", response_model=FlightDetailView, responses=answers(*_ONE))
async def get_flight(
    principal: Viewer, hub: HubDep, database: DatabaseDep, flights: FlightsDep, flight_id: FlightPath
) -> Response:
    """Returns one flight with its index: what happened, in order. Also while it is being recorded."""
    row, drone = await known_flight(hub, database, principal, flight_id)
    async with database.reading() as session:
        pilots = await catalogue.pilots_of(session, [row.id])
        recordings = await recordings_catalogue.of_drone(session, row.drone_id)
    view = catalogue.view_of(row, drone.record.name, pilots.get(row.id, []))
    video = _video(recordings, row, drone, principal)
    is_here = row.store == flights.files.id
    document = await asyncio.to_thread(
        detail_document, flights.files if is_here else None, row.drone_id, row.file, view, video
    )
    return Response(document, media_type="application/json", headers={"Cache-Control": "no-store"})


@router.get(
    "/{flight_id}/tlog",
    response_class=Response,
    responses={
        200: {"content": {TLOG_TYPE: {}}, "description": "The whole flight as a telemetry log"},
        206: {"content": {TLOG_TYPE: {}}, "description": "The range that was asked for"},
        400: {"description": "The range cannot be read"},
        416: {"description": "The file has no such range"},
        **answers(*_FILE),
    },
)
async def get_flight_tlog(
    principal: Viewer, hub: HubDep, database: DatabaseDep, flights: FlightsDep, flight_id: FlightPath
) -> FileResponse:
    """Downloads every frame of the flight, for Mission Planner, MAVProxy and pymavlink."""
    row, drone = await known_flight(hub, database, principal, flight_id)
    path = _whole(flights, row)
    if not await asyncio.to_thread(path.is_file):
        raise UnknownFlight
    headers = {"Cache-Control": "private, no-cache"}
    return FileResponse(path, media_type=TLOG_TYPE, filename=_name(drone, row, "tlog"), headers=headers)


@router.get(
    "/{flight_id}/export/{format_name}",
    response_class=Response,
    responses={
        200: {
            "content": {one.media_type: {} for one in FORMATS.values()},
            "description": "The positions of the flight",
        },
        **answers(*_FILE),
    },
)
async def export_flight(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    flights: FlightsDep,
    flight_id: FlightPath,
    format_name: FormatName,
) -> StreamingResponse:
    """Downloads the positions of the flight as CSV (with attitude, speeds, battery and mode), KML or GPX."""
    row, drone = await known_flight(hub, database, principal, flight_id)
    path = _whole(flights, row)
    if not await asyncio.to_thread(path.is_file):
        raise UnknownFlight
    title = f"{drone.record.name} {row.began_at:%Y-%m-%d %H:%M:%S} UTC"
    name = _name(drone, row, format_name)
    return export_stream(path, format_name, title=title, file_name=name, turns=flights.export_turns)


@router.get(
    "/{flight_id}/report",
    response_class=Response,
    responses={
        200: {"content": {REPORT_TYPE: {}}, "description": "A page that needs no other file"},
        **answers(*_FILE),
    },
)
async def report_flight(
    principal: Viewer, hub: HubDep, database: DatabaseDep, flights: FlightsDep, flight_id: FlightPath
) -> Response:
    """Downloads the flight as a report for people: who had the controls, commands, holds, alerts, all in order."""
    row, drone = await known_flight(hub, database, principal, flight_id)
    if row.state == catalogue.RUNNING:
        raise FlightRunning
    if row.store != flights.files.id:
        raise FlightElsewhere
    async with database.reading() as session:
        pilots = await catalogue.pilots_of(session, [row.id])
        recordings = await recordings_catalogue.of_drone(session, row.drone_id)
    view = catalogue.view_of(row, drone.record.name, pilots.get(row.id, []))
    video = _video(recordings, row, drone, principal)

    def made() -> bytes:
        index, is_whole = index_entries(flights.files, row.drone_id, row.file)
        made_at = hub.state.clock()
        return report(view, index, video, is_whole=is_whole, made_at=made_at, made_for=principal.name).encode()

    async with flights.export_turns:
        document = await asyncio.to_thread(made)
    name = quote(_name(drone, row, "html"), safe="")
    headers = {
        "Content-Disposition": f"attachment; filename*=utf-8''{name}",
        "Cache-Control": "private, no-cache",
    }
    return Response(document, media_type=REPORT_TYPE, headers=headers)


@router.delete("/{flight_id}", status_code=204, responses=answers(UnknownFlight, FlightRunning))
async def delete_flight(principal: Admin, flights: FlightsDep, audit: AuditDep, flight_id: FlightPath) -> None:
    """Admins: deletes a flight for good. Owners cannot: it may be wanted after an incident."""
    await flights.service.delete(flight_id, audit.action(principal))


def _video(
    recordings: Iterable[RecordingRow], flight: FlightRow, drone: LiveDrone, principal: Principal
) -> list[FlightVideoView]:
    """The recordings that show a part of the flight; none for somebody from whom the video was taken."""
    if principal.user_id == drone.no_video_user_id:
        return []
    return [
        FlightVideoView(
            id=one.id,
            began_at=one.began_at,
            first_picture_at=one.first_picture_at,
            ended_at=one.ended_at,
            quality=one.quality,
            state=one.state,
        )
        for one in recordings
        if (flight.ended_at is None or one.shows_from < flight.ended_at)
        and (one.ended_at is None or one.ended_at > flight.began_at)
    ]


def _whole(flights: Flights, row: FlightRow) -> FilePath:
    """Raises FlightRunning, FlightElsewhere."""
    if row.state == catalogue.RUNNING:
        raise FlightRunning
    if row.store != flights.files.id:
        raise FlightElsewhere
    return flights.files.path(row.drone_id, row.file, TLOG)


def _name(drone: LiveDrone, row: FlightRow, ending: str) -> str:
    return f"{drone.record.name}-{row.began_at:%Y%m%d-%H%M%S}.{ending}"
