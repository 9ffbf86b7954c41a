"""`/api/v1/drones/{id}/parameters`: the autopilot's parameters. Viewers read, the holder writes, no borrower does."""

from __future__ import annotations

import gzip
from asyncio import to_thread
from typing import Annotated, Final

from fastapi import APIRouter, Header, Path, Request, Response

from server.http.access import Pilot, Viewer
from server.http.content_coding import accepted_codings
from server.http.dependencies import AddressDep, AuthenticatorDep, HubDep
from server.http.problem_docs import answers
from server.http.strict_body import read_body
from server.kernel.access import Action, UnknownDrone
from server.operations.api.operation_requests import (
    ACCEPTED,
    Prefer,
    answer,
    begin,
    flown_drone,
    watched_drone,
)
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
from server.operations.core.views import OperationView
from server.parameters.core.metadata import MetadataView, NoMetadata, metadata_json
from server.parameters.core.orders import (
    VALUES_SCHEMA,
    ParametersUnknown,
    ParametersView,
    ValuesToWrite,
    parameters_json,
    reread,
    write,
)
from server.plans.core.plan_body import BadPlan, MalformedBody, body_schema

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/parameters", tags=["parameters"], responses=answers(UnknownDrone, ViewTaken)
)

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
GZIP_LEVEL: Final = 5
"""Takes less than a millisecond for the table of a Copter, and is nearly as small as the maximum level."""
NOT_A_BORROWERS: Final = "without its parameters: they are its owner's to change"


@router.get(
    "",
    response_model=ParametersView,
    responses=answers(ParametersUnknown) | {304: {"description": "Still those of `If-None-Match`"}},
)
async def get_parameters(
    principal: Viewer,
    hub: HubDep,
    drone_id: DronePath,
    if_none_match: Annotated[str | None, Header(description="ETags that the client has")] = None,
    accept_encoding: Annotated[str | None, Header(include_in_schema=False)] = None,
) -> Response:
    """Returns all parameters, as the agent knows them. The agent reads them when the autopilot appears, and receives
    every change."""
    drone = watched_drone(hub, principal, drone_id)
    reported = drone.onboard.parameters
    tag = f'"{reported.state.hash}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache", "Vary": "Accept-Encoding"}
    if reported.state.hash is not None and _names(if_none_match, tag):
        return Response(status_code=304, headers=headers)
    table = reported.table()
    if table is None:
        raise ParametersUnknown(drone.record.name, reported.state.count, reported.state.total)
    body = parameters_json(reported, table)
    if "gzip" in accepted_codings(accept_encoding or ""):
        # About 1,400 parameters are 65 kB, which takes three round trips more than the compressed body.
        body = gzip.compress(body, GZIP_LEVEL, mtime=0)
        headers["Content-Encoding"] = "gzip"
    return Response(body, media_type="application/json", headers=headers)


@router.get(
    "/metadata",
    response_model=MetadataView,
    responses=answers(NoMetadata) | {304: {"description": "Still that of `If-None-Match`"}},
)
async def get_parameter_metadata(
    principal: Viewer,
    hub: HubDep,
    drone_id: DronePath,
    if_none_match: Annotated[str | None, Header(description="ETags that the client has")] = None,
    accept_encoding: Annotated[str | None, Header(include_in_schema=False)] = None,
) -> Response:
    """Returns the vehicle's own description of its parameters: texts, units, ranges, defaults, choices, bits. The agent
    reads it from the autopilot, if the autopilot offers it (COMPONENT_METADATA)."""
    drone = watched_drone(hub, principal, drone_id)
    metadata = drone.onboard.metadata
    packed = metadata.packed()
    if packed is None:
        raise NoMetadata(drone.record.name, metadata.words)
    tag = f'"{metadata.reported}"'
    headers = {"ETag": tag, "Cache-Control": "private, no-cache", "Vary": "Accept-Encoding"}
    if _names(if_none_match, tag):
        return Response(status_code=304, headers=headers)
    coded = "gzip" in accepted_codings(accept_encoding or "")
    try:
        body = await to_thread(_metadata_body, packed, coded=coded)
    except ValueError:
        metadata.unreadable(packed)
        raise NoMetadata(drone.record.name, metadata.words) from None
    if coded:
        headers["Content-Encoding"] = "gzip"
    return Response(body, media_type="application/json", headers=headers)


def _metadata_body(packed: bytes, *, coded: bool) -> bytes:
    body = metadata_json(packed)
    return gzip.compress(body, GZIP_LEVEL, mtime=0) if coded else body


@router.post(
    "/read", responses=answers(OnlyWatches, DroneOffline, AgentTooOld, DroneBusy, TooManyOperations) | ACCEPTED
)
async def read_parameters(
    response: Response, principal: Viewer, hub: HubDep, address: AddressDep, drone_id: DronePath, prefer: Prefer = None
) -> OperationView:
    """Reads all parameters from the autopilot again."""
    drone = watched_drone(hub, principal, drone_id)
    return await answer(begin(hub, principal, drone, reread(), address), response, prefer)


@router.patch(
    "",
    responses=answers(
        *(DroneOffline, AgentTooOld, DroneBusy, TooManyOperations), *(NotInControl, Assisted, LoanForbids)
    )
    | answers(MalformedBody, BadPlan)
    | ACCEPTED,
    openapi_extra=body_schema({"values": VALUES_SCHEMA}, ["values"]),
)
async def write_parameters(
    request: Request,
    response: Response,
    principal: Pilot,
    authenticator: AuthenticatorDep,
    hub: HubDep,
    address: AddressDep,
    drone_id: DronePath,
    prefer: Prefer = None,
) -> OperationView:
    """Writes these parameters in this order and reads each back. `refusals` lists those that differ from the
    request."""
    body = await read_body(request, ValuesToWrite)
    principal = await authenticator.admit(request, Action.FLY)
    drone = await flown_drone(hub, principal, drone_id)
    if drone.limits_of(principal.user_id, principal.role) is not None:
        raise LoanForbids(drone.record.name, NOT_A_BORROWERS)
    return await answer(begin(hub, principal, drone, write(body.values), address), response, prefer)


def _names(if_none_match: str | None, tag: str) -> bool:
    """RFC 9110, 13.1.2: weak comparison."""
    if if_none_match is None:
        return False
    tags = [one.strip().removeprefix("W/") for one in if_none_match.split(",")]
    return tag in tags or tags == ["*"]
