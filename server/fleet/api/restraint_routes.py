"""`/api/v1/drones/{id}/restraint`: mute, limit or quarantine a drone that sends too much, for admins of the tower and
of its team."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path
from pydantic import BaseModel, ConfigDict, Field

from server.fleet.core.views import DroneView, RestraintView
from server.fleet.store.restraints import lift_restraint, restrain
from server.http.access import TeamEditor
from server.http.dependencies import AuditDep, DatabaseDep, HubDep, RosterDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.kernel.restraint import Measure
from server.link.core.restraint import LosesItsLink, effect_of, needs_confirmation
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from wire.ids import DroneId

router = APIRouter(
    prefix="/api/v1/drones/{drone_id}/restraint",
    tags=["drones"],
    responses=answers(NotSignedIn, SessionExpired, AdminsOnly, UnknownDrone),
)
Id = Annotated[int, Path(ge=1, le=2**31 - 1)]


class MeasureView(BaseModel):
    """A measure that may be taken now."""

    measure: Measure
    effect: Annotated[str, Field(description="What it does to this drone and its flight now, for people")]
    needs_confirmation: Annotated[bool, Field(description="It may cost a flight: `PUT` needs `confirmed`")]


class RestraintsView(BaseModel):
    now: Annotated[RestraintView | None, Field(description="What is done already; null: nothing")]
    measures: Annotated[list[MeasureView], Field(description="The mildest first; each includes the milder ones")]


class NewRestraint(BaseModel):
    model_config = ConfigDict(extra="forbid")

    measure: Measure
    reason: Annotated[str, Field(max_length=200, description="For the people of the drone")] = ""
    confirmed: Annotated[bool, Field(description="Also if the drone loses its link in the air")] = False


def _drone(hub: Hub, principal: Principal, drone_id: int) -> LiveDrone:
    found = hub.squads.drone(DroneId(drone_id), principal.user_id, principal.role)
    if found is None:
        raise UnknownDrone
    if not found.may(principal.user_id, principal.role, Right.RESTRAIN):
        raise AdminsOnly
    return found


@router.get("")
async def get_restraint(admin: TeamEditor, hub: HubDep, drone_id: Id) -> RestraintsView:
    """Returns what is done because this drone sends too much, and what each measure would do to its flight now."""
    drone = _drone(hub, admin, drone_id)
    measures = [
        MeasureView(measure=one, effect=effect_of(drone, one), needs_confirmation=needs_confirmation(drone, one))
        for one in Measure
    ]
    return RestraintsView(now=RestraintView.of(drone.record.restraint, drone.noise), measures=measures)


@router.put("", responses=answers(LosesItsLink))
async def restrain_drone(
    admin: TeamEditor,
    audit: AuditDep,
    database: DatabaseDep,
    hub: HubDep,
    roster: RosterDep,
    drone_id: Id,
    body: NewRestraint,
) -> DroneView:
    """Mutes, limits or quarantines the drone until somebody lifts that, in place of an earlier measure. 409
    `loses-its-link` for a quarantine of a drone that may be in the air, without `confirmed`. Admins of its team do not
    change what an admin of the tower did."""
    drone = _drone(hub, admin, drone_id)
    if needs_confirmation(drone, body.measure) and not body.confirmed:
        raise LosesItsLink(drone)
    async with database.writing() as session:
        await restrain(
            session,
            drone_id=drone_id,
            measure=body.measure,
            reason=body.reason.strip(),
            by=admin,
            action=audit.action(admin),
        )
    await roster.refresh()
    return _drone(hub, admin, drone_id).view_for(admin.user_id, admin.role)


@router.delete("")
async def end_restraint(
    admin: TeamEditor, audit: AuditDep, database: DatabaseDep, hub: HubDep, roster: RosterDep, drone_id: Id
) -> DroneView:
    """Lifts what an admin did. What the tower does by itself ends when the drone is quiet."""
    _drone(hub, admin, drone_id)
    async with database.writing() as session:
        await lift_restraint(session, drone_id=drone_id, by=admin, action=audit.action(admin))
    await roster.refresh()
    return _drone(hub, admin, drone_id).view_for(admin.user_id, admin.role)
