"""`/api/v1/drones`: the squad, answered from the live state, and the administration of drones for admins."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path
from pydantic import BaseModel, ConfigDict, Field

from server.api.access import Admin, Viewer
from server.api.dependencies import AuditDep, DatabaseDep, EventHandlerDep, HubDep, RecordingsDep, RosterDep
from server.api.http.problem_docs import answers
from server.domain.access import AdminsOnly, NotSignedIn, SessionExpired, UnknownDrone
from server.domain.people import Principal
from server.live.fleet.views import DroneView
from server.live.hub import Hub
from server.store.accounts.users import UnknownUser
from server.store.fleet import drones
from server.store.fleet.drones import DroneNameTaken
from wire.ids import DroneId

router = APIRouter(prefix="/api/v1/drones", tags=["drones"], responses=answers(NotSignedIn, SessionExpired))

DronePath = Annotated[int, Path(ge=1, le=2**31 - 1)]
UserPath = Annotated[int, Path(ge=1, le=2**31 - 1)]


class DroneName(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(description="1 to 64 printable characters")]


class CreatedDrone(BaseModel):
    """A new drone. Enrol an agent to connect it."""

    drone: DroneView


def _view(hub: Hub, principal: Principal, drone_id: int) -> DroneView:
    found = hub.squads.view(DroneId(drone_id), principal.user_id, principal.role)
    if found is None:
        raise UnknownDrone
    return found


@router.get("")
async def list_drones(principal: Viewer, hub: HubDep) -> list[DroneView]:
    """The squad: the drones that you may see; all drones for an admin."""
    return hub.squads.views(principal.user_id, principal.role)


@router.post("", status_code=201, responses=answers(AdminsOnly, DroneNameTaken))
async def create_drone(
    admin: Admin, database: DatabaseDep, audit: AuditDep, roster: RosterDep, hub: HubDep, body: DroneName
) -> CreatedDrone:
    """Creates a drone. Enrol an agent to connect it."""
    async with database.writing() as session:
        row = await drones.create_drone(session, name=body.name, action=audit.action(admin))
    await roster.refresh()
    return CreatedDrone(drone=_view(hub, admin, row.id))


@router.get("/{drone_id}", responses=answers(UnknownDrone))
async def get_drone(principal: Viewer, hub: HubDep, drone_id: DronePath) -> DroneView:
    """One drone of your squad. 404 for all others."""
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
    """Deletes a drone and its recordings, and refuses its agent. The id is never reused."""
    async with database.writing() as session:
        await drones.delete_drone(session, drone_id=drone_id, action=audit.action(admin))
    await roster.refresh()
    await asyncio.to_thread(recordings.store.remove_drones, (drone_id,))


@router.delete("/{drone_id}/key", responses=answers(AdminsOnly, UnknownDrone))
async def revoke_key(
    admin: Admin, database: DatabaseDep, audit: AuditDep, roster: RosterDep, hub: HubDep, drone_id: DronePath
) -> DroneView:
    """Revokes the drone's key. The agent's link ends at once. Enrol an agent again to connect the drone."""
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
    """Lets a user see and fly the drone. Idempotent."""
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
    """Removes an owner. The drone leaves the user's squad at once."""
    async with database.writing() as session:
        await drones.remove_owner(session, drone_id=drone_id, user_id=user_id, action=audit.action(admin))
    await roster.refresh()
    await event_handler.caught_up()  # what they lose with it, they have lost when this is answered
    return _view(hub, admin, drone_id)
