"""`/api/v1/drones/{id}/recordings`: recordings of a drone's video, and their files."""

from __future__ import annotations

import asyncio
import time
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Body, Path, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field

from server.http.access import Pilot, Viewer
from server.http.dependencies import AuditDep, DatabaseDep, HubDep, RecordingsDep
from server.http.problem_docs import answers
from server.kernel.access import UnknownDrone
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.api.operation_requests import refuse_observers, watched_drone
from server.operations.core.refusals import DroneOffline, OnlyWatches, TooManyOperations, ViewTaken
from server.storage.database import Database
from server.video.api.video_answer import VIDEO_ANSWERS, video_answer
from server.video.core.recordings.refusals import (
    AlreadyRecording,
    NotReady,
    NotYourRecording,
    NotYoursToRecord,
    NoVideo,
    RecordingBusy,
    RecordingStorageFull,
    TooManyRecordings,
    UnknownRecording,
)
from server.video.core.recordings.views import RecordingView
from server.video.store import catalogue
from server.video.store.recordings import Recordings
from server.video.store.service import NOT_HERE
from server.video.store.store import MP4
from wire.video import Quality

router = APIRouter(prefix="/api/v1/drones/{drone_id}/recordings", tags=["recordings"])

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
RecordingPath = Annotated[int, Path(ge=1, le=2**31 - 1)]
_WATCH: Final = (UnknownDrone, ViewTaken, OnlyWatches)


class RecordingRequest(BaseModel):
    """What to record."""

    model_config = ConfigDict(extra="forbid")

    quality: Annotated[
        Literal["low", "medium", "high"] | None, Field(description="null: the best quality watched now, else medium")
    ] = None


def video_drone(hub: Hub, principal: Principal, drone_id: int) -> LiveDrone:
    """Returns a drone whose recorded video this user may see. Raises UnknownDrone, ViewTaken, OnlyWatches."""
    drone = watched_drone(hub, principal, drone_id)
    refuse_observers(drone, principal)
    if principal.user_id == drone.no_video_user_id:
        raise ViewTaken(drone.record.name)
    return drone


def _recorded_drone(hub: Hub, principal: Principal, drone_id: int) -> LiveDrone:
    """Raises UnknownDrone, ViewTaken, NotYoursToRecord."""
    drone = video_drone(hub, principal, drone_id)
    if not drone.may(principal.user_id, principal.role, Right.RECORD):
        raise NotYoursToRecord(drone.record.name)
    return drone


@router.get("", responses=answers(*_WATCH))
async def list_recordings(
    principal: Viewer, hub: HubDep, database: DatabaseDep, recordings: RecordingsDep, drone_id: DronePath
) -> list[RecordingView]:
    """Lists all recordings of a drone, including running ones, newest first."""
    drone = video_drone(hub, principal, drone_id)
    async with database.reading() as session:
        rows = await catalogue.of_drone(session, drone.drone_id)
    user_id, role = principal.user_id, principal.role
    return [recordings.service.view(row) for row in rows if drone.knows_of(user_id, role, row.began_at)]


@router.post(
    "",
    status_code=201,
    responses=answers(
        *(*_WATCH, NotYoursToRecord, DroneOffline, NoVideo, AlreadyRecording, TooManyRecordings, RecordingStorageFull),
        TooManyOperations,
    ),
)
async def begin_recording(
    principal: Pilot,
    hub: HubDep,
    recordings: RecordingsDep,
    audit: AuditDep,
    drone_id: DronePath,
    body: Annotated[RecordingRequest | None, Body()] = None,
) -> RecordingView:
    """Holder or admin: starts recording the drone's video."""
    drone = _recorded_drone(hub, principal, drone_id)
    if not hub.flood.admits_recording(principal.user_id, time.monotonic()):
        raise TooManyOperations
    named = body.quality if body is not None else None
    quality = None if named is None else Quality[named.upper()]
    return await recordings.service.begin(drone, principal, quality, audit.action(principal))


@router.get("/{recording_id}", responses=answers(*_WATCH, UnknownRecording))
async def get_recording(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    recordings: RecordingsDep,
    drone_id: DronePath,
    recording_id: RecordingPath,
) -> RecordingView:
    """Returns one recording."""
    drone = video_drone(hub, principal, drone_id)
    return await _view(database, recordings, principal, drone, recording_id)


@router.post("/{recording_id}/stop", responses=answers(*_WATCH, NotYoursToRecord, UnknownRecording, TooManyOperations))
async def end_recording(
    principal: Pilot,
    hub: HubDep,
    database: DatabaseDep,
    recordings: RecordingsDep,
    audit: AuditDep,
    drone_id: DronePath,
    recording_id: RecordingPath,
) -> RecordingView:
    """Holder or admin: ends a recording and makes its file. A recording that has ended stays as it is."""
    drone = _recorded_drone(hub, principal, drone_id)
    # Not from the budget for holding and landing: a flood of such requests must not use that up.
    if not hub.flood.admits_operation(principal.user_id, time.monotonic(), stops=False):
        raise TooManyOperations
    await _view(database, recordings, principal, drone, recording_id)
    await recordings.service.end(recording_id, audit.action(principal))
    return await _view(database, recordings, principal, drone, recording_id)


@router.get(
    "/{recording_id}/file",
    response_class=Response,
    responses={
        **VIDEO_ANSWERS,
        **answers(*_WATCH, UnknownRecording, NotReady),
    },
)
async def get_recording_file(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    recordings: RecordingsDep,
    drone_id: DronePath,
    recording_id: RecordingPath,
) -> FileResponse:
    """Downloads the video, as MP4 with H.264."""
    drone = video_drone(hub, principal, drone_id)
    async with database.reading() as session:
        row = await catalogue.known_to(session, principal, drone, recording_id)
    if row.store != recordings.store.id:
        raise NotReady(NOT_HERE)
    if row.state != "ready":
        raise NotReady(row.words if row.state == "failed" else "it is not ready yet: it is being recorded or processed")
    path = recordings.store.path(row.drone_id, row.file, MP4)
    return await video_answer(path, UnknownRecording, drone=drone.record.name, began_at=row.began_at)


@router.delete(
    "/{recording_id}", status_code=204, responses=answers(*_WATCH, NotYourRecording, UnknownRecording, RecordingBusy)
)
async def delete_recording(
    principal: Pilot,
    hub: HubDep,
    database: DatabaseDep,
    audit: AuditDep,
    recordings: RecordingsDep,
    drone_id: DronePath,
    recording_id: RecordingPath,
) -> None:
    """Owner of the drone, admin of its team or of the tower: deletes a recording for good."""
    drone = video_drone(hub, principal, drone_id)
    if not drone.may(principal.user_id, principal.role, Right.ERASE):
        raise NotYourRecording(drone.record.name)
    async with database.writing() as session:
        await catalogue.known_to(session, principal, drone, recording_id)
        row = await catalogue.delete(session, drone.drone_id, recording_id, action=audit.action(principal))
    if row.store == recordings.store.id:
        await asyncio.to_thread(recordings.store.remove, row.drone_id, row.file)
    recordings.notifier.publish("removed", catalogue.view_of(row))


async def _view(
    database: Database, recordings: Recordings, principal: Principal, drone: LiveDrone, recording_id: int
) -> RecordingView:
    async with database.reading() as session:
        row = await catalogue.known_to(session, principal, drone, recording_id)
    return recordings.service.view(row)
