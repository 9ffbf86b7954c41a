"""`/api/v1/flights/{id}/video/{recording_id}/display`: a recording of the flight with a burnt-in flight display."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response
from fastapi.responses import FileResponse

from server.flights.api.readable import known_flight
from server.flights.core.refusals import FlightElsewhere, FlightRunning, UnknownFlight
from server.flights.core.videos.refusals import FlightVideoNotMade, FlightVideosBusy
from server.flights.core.videos.views import DisplayVideoView
from server.flights.store import catalogue
from server.flights.store.files import INDEX, TLOG
from server.flights.store.tables import FlightRow
from server.flights.store.videos.service import FlightVideos, Sources
from server.http.access import Viewer
from server.http.dependencies import DatabaseDep, FlightsDep, HubDep, RecordingsDep, provided
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired
from server.kernel.people import Principal
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.storage.database import Database
from server.video.api.video_answer import VIDEO_ANSWERS, video_answer
from server.video.core.recordings.refusals import NotReady, UnknownRecording
from server.video.store import catalogue as recordings_catalogue
from server.video.store.service import NOT_HERE
from server.video.store.store import MP4
from server.video.store.tables import RecordingRow

FlightVideosDep = Annotated[FlightVideos, provided(FlightVideos)]
router = APIRouter(
    prefix="/api/v1/flights/{flight_id}/video/{recording_id}/display",
    tags=["flights"],
    responses=answers(NotSignedIn, SessionExpired, UnknownFlight, UnknownRecording),
)

FlightPath = Annotated[int, Path(ge=1, le=2**31 - 1)]
RecordingPath = Annotated[int, Path(ge=1, le=2**31 - 1)]


async def _known(
    hub: Hub, database: Database, principal: Principal, flight_id: int, recording_id: int
) -> tuple[FlightRow, RecordingRow, LiveDrone]:
    """Raises UnknownFlight, UnknownRecording: also where the user may see the flight and not its video."""
    flight, drone = await known_flight(hub, database, principal, flight_id)
    if principal.user_id == drone.no_video_user_id:
        raise UnknownRecording
    async with database.reading() as session:
        recording = await recordings_catalogue.known_to(session, principal, drone, recording_id)
    is_before = recording.ended_at is not None and recording.ended_at <= flight.began_at
    is_after = flight.ended_at is not None and recording.shows_from >= flight.ended_at
    if is_before or is_after:
        raise UnknownRecording
    return flight, recording, drone


@router.post("", status_code=202, responses=answers(FlightRunning, FlightElsewhere, NotReady, FlightVideosBusy))
async def make_display_video(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    flights: FlightsDep,
    recordings: RecordingsDep,
    videos: FlightVideosDep,
    flight_id: FlightPath,
    recording_id: RecordingPath,
) -> DisplayVideoView:
    """Begins to make the video: every picture of the recording with height, speed, heading, attitude, battery, mode,
    holder, link and hold of its moment. It is kept for an hour."""
    flight, recording, _ = await _known(hub, database, principal, flight_id, recording_id)
    if flight.state == catalogue.RUNNING:
        raise FlightRunning
    if flight.store != flights.files.id:
        raise FlightElsewhere
    if recording.store != recordings.store.id:
        raise NotReady(NOT_HERE)
    if recording.state != "ready":
        raise NotReady("it is not ready yet: it is being recorded or processed")
    sources = Sources(
        recording=recordings.store.path(recording.drone_id, recording.file, MP4),
        telemetry=flights.files.path(flight.drone_id, flight.file, TLOG),
        index=flights.files.path(flight.drone_id, flight.file, INDEX),
        began_us=round(recording.shows_from.timestamp() * 1e6),
        pictures=recording.pictures,
    )
    return await videos.begin((flight.id, recording.id), sources, principal)


@router.get("", responses=answers(FlightVideoNotMade))
async def get_display_video(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    videos: FlightVideosDep,
    flight_id: FlightPath,
    recording_id: RecordingPath,
) -> DisplayVideoView:
    """Returns how far the making is."""
    flight, recording, _ = await _known(hub, database, principal, flight_id, recording_id)
    return videos.view((flight.id, recording.id))


@router.get(
    "/file",
    response_class=Response,
    responses={
        **VIDEO_ANSWERS,
        **answers(FlightVideoNotMade),
    },
)
async def get_display_video_file(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    videos: FlightVideosDep,
    flight_id: FlightPath,
    recording_id: RecordingPath,
) -> FileResponse:
    """Downloads the video, as MP4 with H.264."""
    flight, recording, drone = await _known(hub, database, principal, flight_id, recording_id)
    path = videos.path((flight.id, recording.id))
    return await video_answer(
        path, FlightVideoNotMade, drone=drone.record.name, began_at=recording.began_at, suffix="-display"
    )
