"""`/api/v1/enrolments` and `/enrol`: how the agent of a drone comes by its credential with one command."""

from __future__ import annotations

import shlex
from typing import Annotated

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, ConfigDict, Field

from server.access import Admin, AdminsOnly, NotSignedIn, SessionExpired, UnknownDrone
from server.accounts.sessions import Principal
from server.audit.deed import Deed
from server.fleet import enrolments
from server.fleet.drones import get_drone
from server.fleet.enrolment_news import EnrolmentView
from server.fleet.enrolments import BadEnrolment, UnknownEnrolment
from server.private_path import NotPrivate, is_private_path
from server.problem_docs import answers
from server.tower import address_of, tower_of

router = APIRouter(prefix="/api/v1", tags=["enrolment"])
_ADMINS = answers(NotSignedIn, SessionExpired, AdminsOnly)


class NewEnrolment(BaseModel):
    model_config = ConfigDict(extra="forbid")

    lasts_s: Annotated[float, Field(ge=60, le=604_800, description="Seconds for which the token is good")] = 3600
    autopilot: Annotated[
        str, Field(max_length=200, description="For the command: where the autopilot is, as docs/agent.md spells it")
    ] = ""


class EnrolmentWithToken(BaseModel):
    """The only answer that ever contains the token."""

    enrolment: EnrolmentView
    token: str
    command: Annotated[str, Field(description="To be pasted on the drone's companion computer")]


class Enrol(BaseModel):
    model_config = ConfigDict(extra="forbid")

    token: Annotated[str, Field(max_length=200)]


class Enrolled(BaseModel):
    """The only answer that contains the credential."""

    drone_id: int
    drone: str
    credential: str


def _deed(request: Request, admin: Principal) -> Deed:
    return Deed(by=admin, at=tower_of(request).clock(), address=address_of(request))


@router.post("/drones/{drone_id}/enrolments", status_code=201, responses=_ADMINS | answers(UnknownDrone))
async def begin_enrolment(
    request: Request, admin: Admin, drone_id: Annotated[int, Path(ge=1, le=2**31 - 1)], body: NewEnrolment
) -> EnrolmentWithToken:
    """Makes a token that fetches the drone's credential once. One that was waiting is cancelled."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        row, drone, token, cancelled = await enrolments.begin(
            session, drone_id=drone_id, lasts_s=body.lasts_s, deed=_deed(request, admin)
        )
    for one in [*cancelled, row.id]:
        tower.enrolment_news.tell(one)
    tower.enrolment_news.expect_expiry(row.id, body.lasts_s)
    address = tower.settings.public_url or str(request.base_url).rstrip("/")
    words = ["tower-agent", "enrol", address, token]
    words += ["--autopilot", body.autopilot] if body.autopilot else []
    return EnrolmentWithToken(
        enrolment=EnrolmentView.of(row, drone, tower.clock()), token=token, command=shlex.join(words)
    )


@router.get("/enrolments", responses=_ADMINS)
async def list_enrolments(request: Request, admin: Admin) -> list[EnrolmentView]:
    """Newest first, at most 200."""
    tower = tower_of(request)
    async with tower.database.reading() as session:
        found = await enrolments.list_enrolments(session)
    return [EnrolmentView.of(row, drone, tower.clock()) for row, drone in found]


@router.delete("/enrolments/{enrolment_id}", status_code=204, responses=_ADMINS | answers(UnknownEnrolment))
async def cancel_enrolment(
    request: Request, admin: Admin, enrolment_id: Annotated[int, Path(ge=1, le=2**31 - 1)]
) -> None:
    """The token is worth nothing from then on. One that was used stays used."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        row = await enrolments.cancel(session, enrolment_id=enrolment_id, deed=_deed(request, admin))
    tower.enrolment_news.tell(row.id)


@router.post("/enrol", responses=answers(BadEnrolment, NotPrivate))
async def enrol(request: Request, body: Enrol) -> Enrolled:
    """For the agent: gives the token, gets a new credential, once. Over TLS or from this very machine only."""
    if not is_private_path(request):
        raise NotPrivate
    tower = tower_of(request)
    async with tower.database.writing() as session:
        row, credential = await enrolments.use(session, token=body.token, at=tower.clock(), address=address_of(request))
        drone = await get_drone(session, row.drone_id)
    await tower.roster.refresh()
    tower.enrolment_news.tell(row.id)
    return Enrolled(drone_id=drone.id, drone=drone.name, credential=str(credential))
