"""`/api/v1/drones`: the squad for every user, answered from the live picture, and drone administration for admins."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path
from pydantic import BaseModel, ConfigDict, Field

from server.accounts.store.users import UnknownUser
from server.fleet.core.views import DroneView
from server.fleet.store import drones
from server.fleet.store.drones import DroneNameTaken
from server.http.access import Admin, DroneKeyAdmin, Viewer
from server.http.dependencies import AuditDep, DatabaseDep, EventHandlerDep, HubDep, RecordingsDep, RosterDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.people import Principal
from server.live.hub import Hub
from wire.ids import DroneId

router = APIRouter(prefix="/api/v1/drones", tags=["drones"], responses=answers(NotSignedIn, SessionExpired))

DronePath = Annotated[int, Path(ge=1, le=2**31 - 1)]
UserPath = Annotated[int, Path(ge=1, le=2**31 - 1)]


class DroneName(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(description="1 to 64 printable characters")]


class CreatedDrone(BaseModel):
    """A new drone. No agent can sign in for it before one is enrolled."""

    drone: DroneView


def _view(hub: Hub, principal: Principal, drone_id: int) -> DroneView:
    found = hub.squads.view(DroneId(drone_id), principal.user_id, principal.role)
    if found is None:
        raise UnknownDrone
    return found


@router.get("")
async def list_drones(principal: Viewer, hub: HubDep) -> list[DroneView]:
    """Lists the squad: an operator's own drones, or every drone for an admin."""
    return hub.squads.views(principal.user_id, principal.role)


@router.post("", status_code=201, responses=answers(AdminsOnly, DroneNameTaken))
async def create_drone(
    admin: Admin, database: DatabaseDep, audit: AuditDep, roster: RosterDep, hub: HubDep, body: DroneName
) -> CreatedDrone:
    """Creates a drone. An enrolment then registers its agent's key."""
    async with database.writing() as session:
        row = await drones.create_drone(session, name=body.name, action=audit.action(admin))
    await roster.refresh()
    return CreatedDrone(drone=_view(hub, admin, row.id))


@router.get("/{drone_id}", responses=answers(UnknownDrone))
async def get_drone(principal: Viewer, hub: HubDep, drone_id: DronePath) -> DroneView:
    """Returns one drone of the squad. A drone of somebody else yields 404."""
    return _view(hub, principal, drone_id)


@router.patch("/{drone_id}", responses=answers(AdminsOnly, UnknownDrone, DroneNameTaken))
async def rename_drone(
    admin: Admin,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    hub: HubDep,
    drone_id: DronePath,
    body: DroneName,
) -> DroneView:
    """Renames a drone."""
    async with database.writing() as session:
        await drones.rename_drone(session, drone_id=drone_id, name=body.name, action=audit.action(admin))
    await roster.refresh()
    return _view(hub, admin, drone_id)


@router.delete("/{drone_id}", status_code=204, responses=answers(AdminsOnly, UnknownDrone))
async def delete_drone(
    admin: Admin,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    recordings: RecordingsDep,
    drone_id: DronePath,
) -> None:
    """Deletes a drone and its recordings; its agent is refused from then on. The id is never used again."""
    async with database.writing() as session:
        await drones.delete_drone(session, drone_id=drone_id, action=audit.action(admin))
    await roster.refresh()
    await asyncio.to_thread(recordings.store.remove_drones, (drone_id,))


@router.delete("/{drone_id}/key", responses=answers(AdminsOnly, UnknownDrone))
async def revoke_key(
    admin: DroneKeyAdmin, database: DatabaseDep, audit: AuditDep, roster: RosterDep, hub: HubDep, drone_id: DronePath
) -> DroneView:
    """Ends the link of the drone's agent at once. No agent can sign in for the drone until one is enrolled again."""
    async with database.writing() as session:
        await drones.revoke_key(session, drone_id=drone_id, action=audit.action(admin))
    await roster.refresh()
    return _view(hub, admin, drone_id)


@router.put("/{drone_id}/owners/{user_id}", responses=answers(AdminsOnly, UnknownDrone, UnknownUser))
async def add_owner(
    admin: Admin,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    hub: HubDep,
    drone_id: DronePath,
    user_id: UserPath,
) -> DroneView:
    """Lets a user see and fly the drone. Repeating it changes nothing."""
    async with database.writing() as session:
        await drones.add_owner(session, drone_id=drone_id, user_id=user_id, action=audit.action(admin))
    await roster.refresh()
    return _view(hub, admin, drone_id)


@router.delete("/{drone_id}/owners/{user_id}", responses=answers(AdminsOnly, UnknownDrone, UnknownUser))
async def remove_owner(
    admin: Admin,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    hub: HubDep,
    drone_id: DronePath,
    user_id: UserPath,
) -> DroneView:
    """Removes an owner. The drone disappears from the user's squad at once."""
    async with database.writing() as session:
        await drones.remove_owner(session, drone_id=drone_id, user_id=user_id, action=audit.action(admin))
    await roster.refresh()
    await event_handler.caught_up()  # rights that the user loses are gone before the response
    return _view(hub, admin, drone_id)
