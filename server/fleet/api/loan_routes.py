"""`/api/v1/drones/{id}/loans`: temporary loans of a drone to a user, for admins of the tower and of its team."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from server.accounts.store.users import UnknownUser
from server.control.store.hub_event_handler import HubEventHandler
from server.fleet.core.views import DroneView
from server.fleet.store import loans
from server.fleet.store.loans import OwnerAlready, Terms
from server.fleet.store.roster import Roster
from server.http.access import TeamEditor
from server.http.dependencies import AuditDep, DatabaseDep, EventHandlerDep, HubDep, RosterDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.people import Principal
from server.live.hub import Hub
from wire.ids import DroneId

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/loans/{user_id}",
    tags=["drones"],
    responses=answers(NotSignedIn, SessionExpired, AdminsOnly, UnknownDrone, UnknownUser),
)
Id = Annotated[int, Path(ge=1, le=2**31 - 1)]


class NewLoan(BaseModel):
    model_config = ConfigDict(extra="forbid")

    until: AwareDatetime
    may_arm: bool = True
    max_height_m: Annotated[float | None, Field(ge=1, le=10_000, description="Above home")] = None
    radius_m: Annotated[float | None, Field(ge=5, le=100_000, description="Around home")] = None


@router.put("", responses=answers(OwnerAlready))
async def lend_drone(
    lender: TeamEditor,
    audit: AuditDep,
    database: DatabaseDep,
    hub: HubDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    drone_id: Id,
    user_id: Id,
    body: NewLoan,
) -> DroneView:
    """Lends a drone: the user sees and flies it until the given time, within the limits. Lending again changes the
    terms."""
    action = audit.action(lender)
    terms = Terms(body.until, body.may_arm, body.max_height_m, body.radius_m)
    async with database.writing() as session:
        await loans.lend(session, drone_id=drone_id, user_id=user_id, terms=terms, lender=lender, action=action)
    return await _changed(hub, roster, event_handler, lender, drone_id)


@router.delete("")
async def end_loan(
    lender: TeamEditor,
    database: DatabaseDep,
    audit: AuditDep,
    hub: HubDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    drone_id: Id,
    user_id: Id,
) -> DroneView:
    """Ends a loan early. The user has lost all rights that came with it before the response."""
    async with database.writing() as session:
        await loans.end_loan(session, drone_id=drone_id, user_id=user_id, lender=lender, action=audit.action(lender))
    return await _changed(hub, roster, event_handler, lender, drone_id)


async def _changed(
    hub: Hub, roster: Roster, event_handler: HubEventHandler, lender: Principal, drone_id: int
) -> DroneView:
    await roster.refresh()
    await event_handler.caught_up()
    found = hub.squads.view(DroneId(drone_id), lender.user_id, lender.role)
    if found is None:
        raise UnknownDrone
    return found
