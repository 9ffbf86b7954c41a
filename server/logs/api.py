"""`/api/v1/drones/{id}/logs`: flight logs on board, flight logs that the tower stores, and the agents' uploads."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from datetime import UTC, datetime
from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Request, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel, Field
from starlette.requests import ClientDisconnect

from server.http.access import Pilot, Viewer
from server.http.dependencies import (
    AddressDep,
    ClockDep,
    FlightLogQuotaDep,
    HubDep,
    LogReceiverDep,
    SignInRulesDep,
)
from server.http.private_path import NotPrivate
from server.http.problem_docs import answers
from server.kernel.access import UnknownDrone
from server.kernel.people import Principal
from server.link.api.agent_sign_in import AgentRefused
from server.link.api.link_ticket import drone_of
from server.live.live_drone import LiveDrone
from server.logs.core import BadCredential, FileIncomplete, FileNotTaken, NotAskedFor, UnknownLog
from server.logs.store.quota import FlightLogQuota, KeptLog
from server.operations.api.operation_requests import (
    ACCEPTED,
    Prefer,
    answer,
    begin,
    flown_drone,
    refuse_observers,
    watched_drone,
)
from server.operations.core.operation import Lane, Order, Step
from server.operations.core.refusals import (
    AgentTooOld,
    Assisted,
    DroneBusy,
    DroneOffline,
    LoanForbids,
    NotInControl,
    OnlyWatches,
    TooManyOperations,
    ViewTaken,
)
from server.operations.core.views import LogView, OperationView
from wire.transactions import LogDownloadWork, LogListWork

router = APIRouter(prefix="/api/v1", tags=["logs"])

LIST_WITHIN_S: Final = 60.0
FETCH_WITHIN_S: Final = 600.0
"""Maximum duration of a transaction. The agent keeps the part read by then: a repeated request resumes."""
MEDIA_TYPE: Final = "application/octet-stream"

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
LogPath = Annotated[int, Path(ge=0, le=0xFFFF)]
TransactionPath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
_BEGIN: Final = (
    answers(*(UnknownDrone, ViewTaken, OnlyWatches, DroneOffline, AgentTooOld, DroneBusy, TooManyOperations)) | ACCEPTED
)


class KeptLogView(LogView):
    """A log that the tower stores."""

    kept_at: datetime

    @classmethod
    def of_file(cls, kept: KeptLog) -> KeptLogView:
        began = None if kept.began_unix_s is None else datetime.fromtimestamp(kept.began_unix_s, UTC)
        kept_at = datetime.fromtimestamp(kept.kept_at, UTC)
        return cls(id=kept.log_id, size_bytes=kept.size_bytes, began_at=began, kept_at=kept_at)


class LogsView(BaseModel):
    """Logs, newest first."""

    read_at: Annotated[datetime | None, Field(description="When the list was read; null: not since the tower started")]
    on_board: Annotated[list[LogView] | None, Field(description="null: not known")]
    kept: Annotated[list[KeptLogView], Field(description="Logs stored on the tower")]


async def _kept(quota: FlightLogQuota, drone: LiveDrone, principal: Principal) -> list[KeptLog]:
    """Returns the stored logs that this user may know of: those from before a drone joined its team were another's."""
    found = await asyncio.to_thread(quota.of, drone.drone_id)
    who = principal.user_id, principal.role
    return [one for one in found if drone.knows_of(*who, datetime.fromtimestamp(one.kept_at, UTC))]


@router.get("/drones/{drone_id}/logs", responses=answers(UnknownDrone, ViewTaken, OnlyWatches))
async def get_logs(
    principal: Viewer, hub: HubDep, flight_log_quota: FlightLogQuotaDep, drone_id: DronePath
) -> LogsView:
    """Lists the logs on board when the list was last read, and those of the drone that the tower stores."""
    drone = watched_drone(hub, principal, drone_id)
    refuse_observers(drone, principal)
    kept = await _kept(flight_log_quota, drone, principal)
    onboard = drone.onboard
    return LogsView(
        read_at=onboard.logs_read_at,
        on_board=None if onboard.logs is None else [LogView.of(entry) for entry in onboard.logs],
        kept=[KeptLogView.of_file(one) for one in kept],
    )


@router.post("/drones/{drone_id}/logs/list", responses=_BEGIN)
async def list_logs(
    response: Response, principal: Viewer, hub: HubDep, address: AddressDep, drone_id: DronePath, prefer: Prefer = None
) -> OperationView:
    """Reads the list of logs from the autopilot; on the ground only."""
    drone = watched_drone(hub, principal, drone_id)
    order = Order("log_list", Lane.LOGS, [Step(LogListWork(), LIST_WITHIN_S)], writes=False)
    return await answer(begin(hub, principal, drone, order, address), response, prefer)


@router.post(
    "/drones/{drone_id}/logs/{log_id}/fetch",
    responses=_BEGIN | answers(*(NotInControl, Assisted, LoanForbids, DroneBusy)),
)
async def fetch_log(
    response: Response,
    principal: Pilot,
    hub: HubDep,
    address: AddressDep,
    drone_id: DronePath,
    log_id: LogPath,
    prefer: Prefer = None,
) -> OperationView:
    """Has the agent read a log and send it to the tower. Holder only, because it uses the drone's whole link."""
    drone = await flown_drone(hub, principal, drone_id)
    step = Step(LogDownloadWork(log_id), FETCH_WITHIN_S)
    order = Order("log_download", Lane.LOGS, [step], writes=False, audited=True, about={"log": log_id})
    return await answer(begin(hub, principal, drone, order, address), response, prefer)


@router.get(
    "/drones/{drone_id}/logs/{log_id}/file",
    response_class=Response,
    responses={
        200: {"content": {MEDIA_TYPE: {}}, "description": "The whole log"},
        206: {"content": {MEDIA_TYPE: {}}, "description": "The range that was asked for"},
        400: {"description": "The range cannot be read"},
        416: {"description": "The file has no such range"},
        **answers(UnknownDrone, UnknownLog, ViewTaken, OnlyWatches),
    },
)
async def get_log_file(
    principal: Viewer, hub: HubDep, flight_log_quota: FlightLogQuotaDep, drone_id: DronePath, log_id: LogPath
) -> FileResponse:
    """Downloads a stored log, as the autopilot wrote it."""
    drone = watched_drone(hub, principal, drone_id)
    refuse_observers(drone, principal)
    kept = await _kept(flight_log_quota, drone, principal)
    found = next((one for one in kept if one.log_id == log_id), None)
    if found is None:
        raise UnknownLog
    ending = await asyncio.to_thread(found.ending)
    name = f"{drone.record.name}-log-{log_id}.{ending}"
    return FileResponse(
        found.path, media_type=MEDIA_TYPE, filename=name, headers={"Cache-Control": "private, no-cache"}
    )


_FILE: Final[dict[str, Any]] = {
    "requestBody": {"required": True, "content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}}
}


@router.put(
    "/agent/files/{transaction_id}",
    status_code=204,
    responses=answers(BadCredential, NotPrivate, NotAskedFor, FileNotTaken, FileIncomplete),
    openapi_extra=_FILE,
)
async def put_agent_file(
    request: Request,
    sign_in_rules: SignInRulesDep,
    hub: HubDep,
    clock: ClockDep,
    log_receiver: LogReceiverDep,
    transaction_id: TransactionPath,
) -> None:
    """For agents, with the ticket of their link: uploads the file that a running transaction has requested."""
    until = sign_in_rules.credentials_until
    try:
        drone_id = drone_of(hub, request, credentials_until=until, now=clock())
    except AgentRefused as refused:
        raise (NotPrivate() if refused.status == 403 else BadCredential(refused.words)) from None
    drone = hub.state.drones.get(drone_id)
    operation = hub.operations.transaction(drone_id, transaction_id)
    length = request.headers.get("content-length", "")
    if drone is None or operation is None:
        raise NotAskedFor
    if not (length.isascii() and length.isdigit() and len(length) < 16):
        raise FileIncomplete("the file's length is required: send Content-Length")
    await log_receiver.receive(drone, operation, int(length), _pieces(request))


async def _pieces(request: Request) -> AsyncIterator[bytes]:
    try:
        async for piece in request.stream():
            yield piece
    except ClientDisconnect:
        raise FileIncomplete("the connection broke off") from None
