"""`/api/v1/agent-releases` and `/api/v1/drones/{id}/agent-update`: which releases of the agent there are, and an
update of one drone's agent, which an admin chooses and the agent itself judges."""

from __future__ import annotations

import asyncio
from typing import Annotated, Final

from fastapi import APIRouter, Path, Request, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field

from server.fleet.core.update_refusals import FlownByAnother, UnknownRelease
from server.fleet.io.agent_packages import AgentPackages
from server.http.access import Admin
from server.http.dependencies import AddressDep, ClockDep, HubDep, SignInRulesDep, provided
from server.http.private_path import NotPrivate
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, UnknownDrone
from server.link.api.agent_sign_in import AgentRefused
from server.link.api.link_ticket import drone_of
from server.logs.core import BadCredential
from server.operations.api.operation_requests import ACCEPTED, Prefer, answer, begin, watched_drone
from server.operations.core.operation import Lane, Order, Step
from server.operations.core.refusals import AgentTooOld, DroneBusy, DroneOffline, TooManyOperations, ViewTaken
from server.operations.core.views import OperationView
from wire.agent_update import AGENT_UPDATE, AgentUpdateWork

AgentPackagesDep = Annotated[AgentPackages, provided(AgentPackages)]
router = APIRouter(prefix="/api/v1", tags=["drones"])

WITHIN_S: Final = 300.0
"""A minute of it is the trial of the new release."""
MEDIA_TYPE: Final = "application/octet-stream"
VERSION_PATTERN: Final = r"^[0-9][0-9A-Za-z.]*$"

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
Version = Annotated[str, Field(max_length=40, pattern=VERSION_PATTERN)]


class AgentRelease(BaseModel):
    """A package in the tower's folder of releases. Its signature is the agents' to judge."""

    version: str
    size_bytes: int


class AgentUpdate(BaseModel):
    model_config = ConfigDict(extra="forbid")

    version: Annotated[Version, Field(description="One of `GET /agent-releases`")]
    older: Annotated[bool, Field(description="Install it even if it is older than what runs")] = False


@router.get("/agent-releases", responses=answers(AdminsOnly))
async def list_agent_releases(admin: Admin, agent_packages: AgentPackagesDep) -> list[AgentRelease]:
    """Lists the releases of the agent that drones can be given, newest first."""
    found = await asyncio.to_thread(agent_packages.all)
    return [AgentRelease(version=one.version, size_bytes=one.bytes) for one in found]


@router.post(
    "/drones/{drone_id}/agent-update",
    responses=answers(
        *(AdminsOnly, UnknownDrone, ViewTaken, UnknownRelease, FlownByAnother),
        *(DroneOffline, AgentTooOld, DroneBusy, TooManyOperations),
    )
    | ACCEPTED,
)
async def update_agent(
    response: Response,
    admin: Admin,
    hub: HubDep,
    agent_packages: AgentPackagesDep,
    address: AddressDep,
    drone_id: DronePath,
    body: AgentUpdate,
    prefer: Prefer = None,
) -> OperationView:
    """Has the agent of a drone on the ground install a release and start again. The agent refuses what its release key
    has not signed, and goes back to what it was if the release does not link within a minute."""
    if await asyncio.to_thread(agent_packages.find, body.version) is None:
        raise UnknownRelease(body.version)
    drone = watched_drone(hub, admin, drone_id)
    holder = drone.lease.holder
    if holder is not None and holder.id != admin.user_id:
        raise FlownByAnother(drone.record.name, holder.name)
    writing = [one for lane in Lane for one in hub.operations.running_at(drone.drone_id, lane) if one.order.writes]
    if writing:
        work = writing[0].order.work.replace("_", " ")
        raise DroneBusy(f"{drone.record.name} is busy ({work}): wait, or stop it")
    order = Order(
        "agent_update",
        Lane.AGENT,
        [Step(AgentUpdateWork(body.version, older=body.older), WITHIN_S)],
        writes=True,
        restarts_agent=True,
        needs=AGENT_UPDATE,
        about={"version": body.version, "before": drone.agent_version or "not known", "older": body.older},
    )
    return await answer(begin(hub, admin, drone, order, address), response, prefer)


@router.get(
    "/agent/releases/{version}",
    response_class=Response,
    responses={
        200: {"content": {MEDIA_TYPE: {}}, "description": "The package"},
        206: {"content": {MEDIA_TYPE: {}}, "description": "The range that was asked for"},
        400: {"description": "The range cannot be read"},
        416: {"description": "The file has no such range"},
        **answers(BadCredential, NotPrivate, UnknownRelease),
    },
)
async def get_agent_release(
    request: Request,
    sign_in_rules: SignInRulesDep,
    hub: HubDep,
    clock: ClockDep,
    agent_packages: AgentPackagesDep,
    version: Annotated[str, Path(max_length=40)],
) -> FileResponse:
    """For agents, with the ticket of their link: the package of a release."""
    try:
        drone_of(hub, request, credentials_until=sign_in_rules.credentials_until, now=clock())
    except AgentRefused as refused:
        raise (NotPrivate() if refused.status == 403 else BadCredential(refused.words)) from None
    found = await asyncio.to_thread(agent_packages.find, version)
    if found is None:
        raise UnknownRelease(version)
    return FileResponse(found.path, media_type=MEDIA_TYPE, headers={"Cache-Control": "private, no-cache"})
