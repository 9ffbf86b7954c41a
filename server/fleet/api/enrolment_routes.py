"""`/api/v1/enrolments` and `/enrol`: how a drone's agent registers its key with one command."""

from __future__ import annotations

import shlex
from typing import Annotated

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, ConfigDict, Field

from server.fleet.io.tower_address import AddressUnknown, address_for_agents
from server.fleet.store import enrolments
from server.fleet.store.drones import get_drone
from server.fleet.store.enrolment_notifier import EnrolmentView
from server.fleet.store.enrolments import BadDroneKey, BadEnrolment, UnknownEnrolment
from server.http.access import Admin, DroneKeyAdmin
from server.http.dependencies import (
    AddressDep,
    AuditDep,
    ClockDep,
    DatabaseDep,
    EnrolmentNotifierDep,
    RosterDep,
    SettingsDep,
    SignInRulesDep,
)
from server.http.private_path import NotPrivate, is_private_path
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired, UnknownDrone
from wire.drone_key import key_text

router = APIRouter(prefix="/api/v1", tags=["enrolment"])
_ADMINS = answers(NotSignedIn, SessionExpired, AdminsOnly)

_AGENT = "$(command -v tower-agent || echo /opt/tower-agent/bin/tower-agent)"
"""For a shell: the program of a package or of an activated environment, else that of the documents' wheel."""


class NewEnrolment(BaseModel):
    model_config = ConfigDict(extra="forbid")

    lasts_s: Annotated[float, Field(ge=60, le=604_800, description="Lifetime of the token in seconds")] = 3600
    autopilot: Annotated[
        str, Field(max_length=200, description="The autopilot's port for the command, as in docs/agent.md")
    ] = ""


class EnrolmentWithToken(BaseModel):
    """The only response that ever contains the token."""

    enrolment: EnrolmentView
    token: str
    command: Annotated[str, Field(description="Paste it on the drone's companion computer: it installs the service")]


class Enrol(BaseModel):
    model_config = ConfigDict(extra="forbid")

    token: Annotated[str, Field(max_length=200)]
    public_key: Annotated[
        str, Field(max_length=43, description="Public half of the agent's Ed25519 key: 32 bytes in base64url")
    ]
    signature: Annotated[
        str, Field(max_length=86, description="The key's signature of the token: docs/wire-protocol.md, 2.0")
    ]


class Enrolled(BaseModel):
    """What the agent must know besides its own key."""

    drone_id: int
    drone: str
    tower_key: Annotated[str, Field(description="The tower's own Ed25519 public key, in base64url")]


@router.post(
    "/drones/{drone_id}/enrolments", status_code=201, responses=_ADMINS | answers(UnknownDrone, AddressUnknown)
)
async def begin_enrolment(
    request: Request,
    admin: DroneKeyAdmin,
    settings: SettingsDep,
    database: DatabaseDep,
    audit: AuditDep,
    enrolment_notifier: EnrolmentNotifierDep,
    clock: ClockDep,
    drone_id: Annotated[int, Path(ge=1, le=2**31 - 1)],
    body: NewEnrolment,
) -> EnrolmentWithToken:
    """Creates a token that enrols an agent for the drone, once. Cancels an enrolment that is still pending."""
    address = address_for_agents(settings, str(request.base_url))
    async with database.writing() as session:
        row, drone, token, cancelled = await enrolments.begin(
            session, drone_id=drone_id, lasts_s=body.lasts_s, action=audit.action(admin)
        )
    for one in [*cancelled, row.id]:
        enrolment_notifier.publish(one)
    enrolment_notifier.expect_expiry(row.id, body.lasts_s)
    options = ["install", "--tower", address, "--enrol", token]
    options += ["--autopilot", body.autopilot] if body.autopilot else []
    return EnrolmentWithToken(
        enrolment=EnrolmentView.of(row, drone, clock()), token=token, command=" ".join((_AGENT, shlex.join(options)))
    )


@router.get("/enrolments", responses=_ADMINS)
async def list_enrolments(admin: Admin, database: DatabaseDep, clock: ClockDep) -> list[EnrolmentView]:
    """Lists enrolments, newest first, at most 200."""
    async with database.reading() as session:
        found = await enrolments.list_enrolments(session)
    return [EnrolmentView.of(row, drone, clock()) for row, drone in found]


@router.delete("/enrolments/{enrolment_id}", status_code=204, responses=_ADMINS | answers(UnknownEnrolment))
async def cancel_enrolment(
    admin: DroneKeyAdmin,
    database: DatabaseDep,
    audit: AuditDep,
    enrolment_notifier: EnrolmentNotifierDep,
    enrolment_id: Annotated[int, Path(ge=1, le=2**31 - 1)],
) -> None:
    """Cancels an enrolment: its token becomes invalid. An enrolment that was used stays used."""
    async with database.writing() as session:
        row = await enrolments.cancel(session, enrolment_id=enrolment_id, action=audit.action(admin))
    enrolment_notifier.publish(row.id)


@router.post("/enrol", responses=answers(BadEnrolment, BadDroneKey, NotPrivate))
async def enrol(
    request: Request,
    database: DatabaseDep,
    clock: ClockDep,
    address: AddressDep,
    roster: RosterDep,
    enrolment_notifier: EnrolmentNotifierDep,
    sign_in_rules: SignInRulesDep,
    body: Enrol,
) -> Enrolled:
    """For the agent: registers its key as the drone's key. Over TLS or from this machine only. An agent that did not
    receive the response retries with the same key."""
    if not is_private_path(request):
        raise NotPrivate
    key = enrolments.read_key(token=body.token, public_key=body.public_key, signature=body.signature)
    async with database.writing() as session:
        row = await enrolments.use(session, token=body.token, public_key=key, at=clock(), address=address)
        drone = await get_drone(session, row.drone_id)
    await roster.refresh()
    enrolment_notifier.publish(row.id)
    return Enrolled(drone_id=drone.id, drone=drone.name, tower_key=key_text(sign_in_rules.identity.public_key))
