"""`/api/v1/drones`: the squad for everybody, answered from the live picture, and drones administration for admins."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, ConfigDict, Field

from server.api.access import Admin, Viewer
from server.api.http.problem_docs import answers
from server.api.tower import address_of, tower_of
from server.domain.access import AdminsOnly, NotSignedIn, SessionExpired, UnknownDrone
from server.domain.people import Principal
from server.live.fleet.views import DroneView
from server.store.accounts.users import UnknownUser
from server.store.audit.action import AuditAction
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
    """No agent can sign in as it before one has been enrolled."""

    drone: DroneView


def _action(request: Request, admin: Principal) -> AuditAction:
    return AuditAction(by=admin, at=tower_of(request).clock(), address=address_of(request))


def _view(request: Request, principal: Principal, drone_id: int) -> DroneView:
    found = tower_of(request).hub.drone_view(DroneId(drone_id), principal.user_id, principal.role)
    if found is None:
        raise UnknownDrone
    return found


@router.get("")
async def list_drones(request: Request, principal: Viewer) -> list[DroneView]:
    """The squad: an operator's own drones, or every drone for an admin."""
    return tower_of(request).hub.drone_views(principal.user_id, principal.role)


@router.post("", status_code=201, responses=answers(AdminsOnly, DroneNameTaken))
async def create_drone(request: Request, admin: Admin, body: DroneName) -> CreatedDrone:
    """Creates a drone. An enrolment makes an agent's key its own."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        row = await drones.create_drone(session, name=body.name, action=_action(request, admin))
    await tower.roster.refresh()
    return CreatedDrone(drone=_view(request, admin, row.id))


@router.get("/{drone_id}", responses=answers(UnknownDrone))
async def get_drone(request: Request, principal: Viewer, drone_id: DronePath) -> DroneView:
    """One drone of the squad. One that is somebody else's does not exist."""
    return _view(request, principal, drone_id)


@router.patch("/{drone_id}", responses=answers(AdminsOnly, UnknownDrone, DroneNameTaken))
async def rename_drone(request: Request, admin: Admin, drone_id: DronePath, body: DroneName) -> DroneView:
    """Gives a drone another name."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        await drones.rename_drone(session, drone_id=drone_id, name=body.name, action=_action(request, admin))
    await tower.roster.refresh()
    return _view(request, admin, drone_id)


@router.delete("/{drone_id}", status_code=204, responses=answers(AdminsOnly, UnknownDrone))
async def delete_drone(request: Request, admin: Admin, drone_id: DronePath) -> None:
    """Deletes a drone; its agent is turned away from then on, and its recordings go. Its id is never used again."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        await drones.delete_drone(session, drone_id=drone_id, action=_action(request, admin))
    await tower.roster.refresh()
    await asyncio.to_thread(tower.recordings.store.remove_drones, (drone_id,))


@router.delete("/{drone_id}/key", responses=answers(AdminsOnly, UnknownDrone))
async def revoke_key(request: Request, admin: Admin, drone_id: DronePath) -> DroneView:
    """The link of the drone's agent ends at once, and no agent can sign in as it until one has been enrolled anew."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        await drones.revoke_key(session, drone_id=drone_id, action=_action(request, admin))
    await tower.roster.refresh()
    return _view(request, admin, drone_id)


@router.put("/{drone_id}/owners/{user_id}", responses=answers(AdminsOnly, UnknownDrone, UnknownUser))
async def add_owner(request: Request, admin: Admin, drone_id: DronePath, user_id: UserPath) -> DroneView:
    """Lets a user see and fly the drone. Doing it twice changes nothing."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        await drones.add_owner(session, drone_id=drone_id, user_id=user_id, action=_action(request, admin))
    await tower.roster.refresh()
    return _view(request, admin, drone_id)


@router.delete("/{drone_id}/owners/{user_id}", responses=answers(AdminsOnly, UnknownDrone, UnknownUser))
async def remove_owner(request: Request, admin: Admin, drone_id: DronePath, user_id: UserPath) -> DroneView:
    """The drone disappears from the user's squad at once."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        await drones.remove_owner(session, drone_id=drone_id, user_id=user_id, action=_action(request, admin))
    await tower.roster.refresh()
    await tower.event_handler.caught_up()  # what they lose with it, they have lost when this is answered
    return _view(request, admin, drone_id)
