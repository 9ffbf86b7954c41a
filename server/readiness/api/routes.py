"""`/api/v1/drones/{id}/preflight` and `/api/v1/checklists`: the checklist before a flight, its own lines, and the
pilot's signature."""

from __future__ import annotations

import time
from datetime import datetime
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Path
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from server.control.store.loss_checks import LossChecks
from server.fleet.core.views import UserRefView
from server.http.access import Admin, Pilot, Viewer
from server.http.dependencies import AuditDep, ClockDep, DatabaseDep, HubDep, LossChecksDep
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.bad_field import BadField
from server.kernel.clock import Clock
from server.kernel.people import Principal, UserRef
from server.kernel.relations import Right
from server.live.live_drone import LiveDrone
from server.operations.api.operation_requests import watched_drone
from server.operations.core.refusals import ViewTaken
from server.readiness.core.checks import CheckLine, preflight_lines
from server.readiness.core.facts_of import kind_of, preflight_facts, profile_of
from server.readiness.core.refusals import NoSuchKind, NotYourChecklist, PreflightIncomplete, SignsForPilot
from server.readiness.core.signature import Signature, SignedLine
from server.readiness.store.checklists import keep_lines, read_lines, scope_of_drone, scope_of_kind
from server.storage.database import Database
from wire.autopilots import registry

router = APIRouter(prefix="/api/v1", tags=["preflight"], responses=answers(NotSignedIn, SessionExpired))

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
Kind = Annotated[str, Path(pattern="^[a-z0-9]{1,32}$", description="`kind` of a drone's checklist")]
MAX_LINES: Final = 40
MAX_LINE_LENGTH: Final = 160


def _clean(text: str) -> str:
    """Raises BadField."""
    words = " ".join(text.split())
    if not words or not words.isprintable():
        raise BadField("a line is 1 to 160 printable characters")
    return words


LineText = Annotated[str, Field(min_length=1, max_length=MAX_LINE_LENGTH), AfterValidator(_clean)]


class PreflightLineView(BaseModel):
    """A line that the tower fills in."""

    key: str
    title: str
    state: Literal["good", "caution", "bad", "unknown"]
    words: str

    @classmethod
    def of(cls, line: CheckLine) -> PreflightLineView:
        return cls(key=line.key, title=line.title, state=line.state.value, words=line.words)


class OwnLineView(BaseModel):
    """A line that people wrote, and that the pilot confirms."""

    text: str
    of: Annotated[Literal["kind", "drone"], Field(description="Whether every drone of the kind has it")]


class SignatureView(BaseModel):
    """Who signed the list for the coming flight, or for the one that is going on."""

    by: UserRefView
    at: datetime
    weather: str

    @classmethod
    def of(cls, signed: Signature) -> SignatureView:
        return cls(by=UserRefView.of(signed.by), at=signed.at, weather=signed.weather)


class PreflightView(BaseModel):
    """The checklist of one drone now."""

    kind: Annotated[str, Field(description="Kind of drone; empty: not known yet")]
    kind_label: str
    lines: list[PreflightLineView]
    own: list[OwnLineView]
    signed: SignatureView | None
    may_sign: Annotated[bool, Field(description="You have the controls, or assist")]
    may_edit: Annotated[bool, Field(description="You may change the lines of this drone")]


class PreflightSignature(BaseModel):
    """`checked`: the text of every own line. `weather`: as the pilot judges it, optional."""

    model_config = ConfigDict(extra="forbid")

    checked: Annotated[list[str], Field(max_length=2 * MAX_LINES)]
    weather: Annotated[str, Field(max_length=200)] = ""


class ChecklistView(BaseModel):
    """Own lines, in order. Replaces those before; none deletes them."""

    model_config = ConfigDict(extra="forbid")

    lines: Annotated[list[LineText], Field(max_length=MAX_LINES)]


@router.get("/drones/{drone_id}/preflight", responses=answers(UnknownDrone, ViewTaken))
async def get_preflight(
    principal: Viewer,
    hub: HubDep,
    database: DatabaseDep,
    loss_checks: LossChecksDep,
    clock: ClockDep,
    drone_id: DronePath,
) -> PreflightView:
    """Returns the checklist as it stands now, and who has signed it."""
    drone = watched_drone(hub, principal, drone_id)
    return await _view(drone, principal, database, loss_checks, clock)


@router.post(
    "/drones/{drone_id}/preflight/sign", responses=answers(UnknownDrone, ViewTaken, SignsForPilot, PreflightIncomplete)
)
async def sign_preflight(
    principal: Pilot,
    hub: HubDep,
    database: DatabaseDep,
    loss_checks: LossChecksDep,
    audit: AuditDep,
    drone_id: DronePath,
    body: PreflightSignature,
) -> PreflightView:
    """Signs the list for the coming flight, in the name of whoever has the controls. The audit trail and the record of
    the flight keep it, with every line as it stood. It is valid for an hour, and for one flight."""
    drone = watched_drone(hub, principal, drone_id)
    if not drone.may_arm(principal.user_id):
        raise SignsForPilot(drone.record.name)
    own = await _own_lines(drone, database)
    missing = {line.text for line in own} - set(body.checked)
    if missing:
        raise PreflightIncomplete(drone.record.name, len(missing))
    action = audit.action(principal)
    lines = [SignedLine(f"{line.title}: {line.words}", line.state) for line in _lines(drone, principal, loss_checks)]
    signature = Signature(
        by=UserRef(principal.user_id, principal.name),
        at=action.at,
        lines=(*lines, *(SignedLine(line.text, "confirmed") for line in own)),
        weather=" ".join(body.weather.split()),
    )
    async with database.writing() as session:
        action.record(session, "preflight.signed", drone_id=drone.drone_id, **signature.about())
    drone.preflight = signature
    hub.flights.note(drone.drone_id, "preflight", signature.about())
    return await _view(drone, principal, database, loss_checks, audit.clock)


@router.put("/drones/{drone_id}/preflight/lines", responses=answers(UnknownDrone, ViewTaken, NotYourChecklist))
async def put_drone_checklist(
    principal: Pilot, hub: HubDep, database: DatabaseDep, audit: AuditDep, drone_id: DronePath, body: ChecklistView
) -> ChecklistView:
    """Replaces the own lines of this drone; for its owners and for admins."""
    drone = watched_drone(hub, principal, drone_id)
    if not drone.may(principal.user_id, principal.role, Right.CHECKLIST):
        raise NotYourChecklist
    scope = scope_of_drone(drone.drone_id)
    async with database.writing() as session:
        await keep_lines(session, scope, body.lines, drone_id=drone.drone_id, action=audit.action(principal))
    return body


@router.get("/checklists/{kind}", responses=answers(NoSuchKind))
async def get_checklist(principal: Viewer, database: DatabaseDep, kind: Kind) -> ChecklistView:
    """Returns the own lines of a kind of drone."""
    async with database.reading() as session:
        found = await read_lines(session, [_scope(kind)])
    return ChecklistView(lines=next(iter(found.values()), []))


@router.put("/checklists/{kind}", responses=answers(NoSuchKind))
async def put_checklist(
    principal: Admin, database: DatabaseDep, audit: AuditDep, kind: Kind, body: ChecklistView
) -> ChecklistView:
    """Replaces the own lines of a kind of drone."""
    async with database.writing() as session:
        await keep_lines(session, _scope(kind), body.lines, drone_id=None, action=audit.action(principal))
    return body


def _scope(kind: str) -> str:
    """Raises NoSuchKind."""
    if all(profile.key != kind for profile in registry.PROFILES):
        raise NoSuchKind
    return scope_of_kind(kind)


def _lines(drone: LiveDrone, principal: Principal, loss_checks: LossChecks) -> list[CheckLine]:
    loss = loss_checks.check(drone.drone_id, principal.user_id)
    return preflight_lines(preflight_facts(drone, loss, time.monotonic()))


async def _own_lines(drone: LiveDrone, database: Database) -> list[OwnLineView]:
    """Those of its kind first."""
    of_kind, of_drone = scope_of_kind(kind_of(drone)), scope_of_drone(drone.drone_id)
    async with database.reading() as session:
        found = await read_lines(session, [of_kind, of_drone])
    kinds = [OwnLineView(text=text, of="kind") for text in found.get(of_kind, [])]
    return kinds + [OwnLineView(text=text, of="drone") for text in found.get(of_drone, [])]


async def _view(
    drone: LiveDrone, principal: Principal, database: Database, loss_checks: LossChecks, clock: Clock
) -> PreflightView:
    own = await _own_lines(drone, database)
    profile, signed = profile_of(drone), drone.preflight
    if signed is not None and not signed.is_valid(clock()):
        signed = None
    return PreflightView(
        kind="" if profile is None else profile.key,
        kind_label="" if profile is None else profile.label,
        lines=[PreflightLineView.of(line) for line in _lines(drone, principal, loss_checks)],
        own=own,
        signed=None if signed is None else SignatureView.of(signed),
        may_sign=drone.may_arm(principal.user_id),
        may_edit=drone.may(principal.user_id, principal.role, Right.CHECKLIST),
    )
