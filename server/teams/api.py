"""`/api/v1/teams` and `/api/v1/me/invitations`: teams of people and drones."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response
from pydantic import BaseModel, ConfigDict, Field

from server.accounts.store.users import UnknownUser
from server.control.store.hub_event_handler import HubEventHandler
from server.fleet.store.roster import Roster
from server.http.access import Oneself, TeamEditor, TeamMember, Viewer
from server.http.dependencies import AuditDep, ClockDep, DatabaseDep, EventHandlerDep, RosterDep
from server.http.long_list import long_list
from server.http.problem_docs import answers
from server.kernel.access import NotSignedIn, SessionExpired, UnknownDrone
from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.kernel.relations import TeamRole
from server.storage.database import Database
from server.teams.core import (
    DroneInUse,
    InAnotherTeam,
    LastTeamAdmin,
    MemberAlready,
    NotYourDrone,
    TeamAdminsOnly,
    TeamFull,
    TooManyTeams,
    UnknownInvitation,
    UnknownTeam,
)
from server.teams.store import invitations, teams
from server.teams.store.teams import TeamManager
from server.teams.store.views import InvitationView, ReceivedView, TeamView, views_of

router = APIRouter(prefix="/api/v1", tags=["teams"], responses=answers(NotSignedIn, SessionExpired))

Id = Annotated[int, Path(ge=1, le=2**31 - 1)]
_LED = answers(UnknownTeam, TeamAdminsOnly)


class TeamName(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(description="1 to 64 printable characters; need not be unique")]


class MemberRole(BaseModel):
    model_config = ConfigDict(extra="forbid")

    role: TeamRole


class NewInvitation(MemberRole):
    name: Annotated[str, Field(description="The user's full name; the response does not reveal whether it exists")]


async def _applied(roster: Roster, event_handler: HubEventHandler) -> None:
    """Applies gained and lost rights (view, controls, video) before the response."""
    await roster.refresh()
    await event_handler.caught_up()


async def _view(database: Database, clock: Clock, principal: Principal, team_id: int) -> TeamView:
    manager = TeamManager.of(principal)
    async with database.reading() as session:
        row = await teams.get_team(session, team_id, manager)
        (view,) = await views_of(session, [row], manager, clock())
    return view


@router.get("/teams", response_model=list[TeamView])
async def list_teams(principal: Viewer, database: DatabaseDep, clock: ClockDep) -> Response:
    """Lists your teams; for an admin of the tower, all teams."""
    manager = TeamManager.of(principal)
    async with database.reading() as session:
        views = await views_of(session, await teams.list_teams(session, manager), manager, clock())
    return await long_list(views, at_once=1)


@router.post("/teams", status_code=201, responses=answers(TooManyTeams))
async def make_team(
    principal: TeamEditor,
    audit: AuditDep,
    database: DatabaseDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    clock: ClockDep,
    body: TeamName,
) -> TeamView:
    """Creates a team with you as its admin. An admin of the tower creates it for others."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        row = await teams.make_team(session, name=body.name, manager=manager, action=action)
        team_id = row.id
    await _applied(roster, event_handler)
    return await _view(database, clock, principal, team_id)


@router.get("/teams/{team_id}", responses=answers(UnknownTeam))
async def get_team(principal: Viewer, database: DatabaseDep, clock: ClockDep, team_id: Id) -> TeamView:
    """Returns one team. A team that you are not in yields 404."""
    return await _view(database, clock, principal, team_id)


@router.patch("/teams/{team_id}", responses=_LED)
async def rename_team(
    principal: TeamEditor,
    audit: AuditDep,
    database: DatabaseDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    clock: ClockDep,
    team_id: Id,
    body: TeamName,
) -> TeamView:
    """Team admin: renames the team."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        await teams.rename_team(session, team_id, name=body.name, manager=manager, action=action)
    await _applied(roster, event_handler)
    return await _view(database, clock, principal, team_id)


@router.delete("/teams/{team_id}", status_code=204, responses=_LED)
async def delete_team(
    principal: TeamEditor,
    audit: AuditDep,
    database: DatabaseDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    team_id: Id,
) -> None:
    """Team admin: deletes the team. Its drones belong to their owners alone again; users who flew one for the team lose
    it."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        await teams.delete_team(session, team_id, manager=manager, action=action)
    await _applied(roster, event_handler)


@router.put("/teams/{team_id}/members/{user_id}", responses=_LED | answers(*(UnknownUser, LastTeamAdmin, TeamFull)))
async def set_team_member(
    principal: TeamEditor,
    audit: AuditDep,
    database: DatabaseDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    clock: ClockDep,
    team_id: Id,
    user_id: Id,
    body: MemberRole,
) -> TeamView:
    """Team admin: changes the role of a member. An admin of the tower can add any user."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        await teams.set_role(session, team_id, user_id=user_id, role=body.role, manager=manager, action=action)
    await _applied(roster, event_handler)
    return await _view(database, clock, principal, team_id)


@router.delete(
    "/teams/{team_id}/members/{user_id}", status_code=204, responses=_LED | answers(UnknownUser, LastTeamAdmin)
)
async def remove_team_member(
    principal: TeamMember,
    audit: AuditDep,
    database: DatabaseDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    team_id: Id,
    user_id: Id,
) -> None:
    """Team admin, or the member: removes a member. The rights that came with the team are gone before the response."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        await teams.remove_member(session, team_id, user_id=user_id, manager=manager, action=action)
    await _applied(roster, event_handler)


@router.put(
    "/teams/{team_id}/drones/{drone_id}",
    responses=_LED | answers(*(UnknownDrone, NotYourDrone, InAnotherTeam, DroneInUse, TeamFull)),
)
async def add_team_drone(
    principal: TeamEditor,
    audit: AuditDep,
    database: DatabaseDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    clock: ClockDep,
    team_id: Id,
    drone_id: Id,
) -> TeamView:
    """Team admin who owns the drone: adds it to the team, and all members see it. Repeating it changes nothing."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        await teams.add_drone(session, team_id, drone_id=drone_id, manager=manager, action=action)
    await _applied(roster, event_handler)
    return await _view(database, clock, principal, team_id)


@router.delete("/teams/{team_id}/drones/{drone_id}", status_code=204, responses=_LED | answers(UnknownDrone))
async def remove_team_drone(
    principal: TeamEditor,
    audit: AuditDep,
    database: DatabaseDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    team_id: Id,
    drone_id: Id,
) -> None:
    """Team admin, or an owner of the drone: removes it. Members who flew it for the team lose it at once."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        await teams.remove_drone(session, team_id, drone_id=drone_id, manager=manager, action=action)
    await _applied(roster, event_handler)


@router.post("/teams/{team_id}/invitations", status_code=201, responses=_LED | answers(MemberAlready, TeamFull))
async def invite_to_team(
    principal: TeamEditor, audit: AuditDep, database: DatabaseDep, team_id: Id, body: NewInvitation
) -> InvitationView:
    """Team admin: invites the user of this name to join within a week. The response does not reveal whether the name
    exists."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        row = await invitations.invite(session, team_id, name=body.name, role=body.role, manager=manager, action=action)
        return InvitationView.of(row)


@router.delete(
    "/teams/{team_id}/invitations/{invitation_id}", status_code=204, responses=_LED | answers(UnknownInvitation)
)
async def withdraw_invitation(
    principal: TeamEditor, audit: AuditDep, database: DatabaseDep, team_id: Id, invitation_id: Id
) -> None:
    """Team admin: withdraws an invitation, which becomes invalid."""
    action, manager = audit.action(principal), TeamManager.of(principal)
    async with database.writing() as session:
        await invitations.withdraw(session, team_id, invitation_id, manager=manager, action=action)


@router.get("/me/invitations")
async def list_invitations(principal: Oneself, database: DatabaseDep, audit: AuditDep) -> list[ReceivedView]:
    """Lists your invitations, newest first."""
    async with database.reading() as session:
        found = await invitations.received(session, principal, audit.action(principal))
        return [ReceivedView.of(one) for one in found]


@router.post("/me/invitations/{invitation_id}/accept", responses=answers(UnknownInvitation, TeamFull))
async def accept_invitation(
    principal: Oneself,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    clock: ClockDep,
    invitation_id: Id,
) -> TeamView:
    """Accepts an invitation: you are in the team from then on."""
    async with database.writing() as session:
        team_id = await invitations.accept(session, principal, invitation_id, action=audit.action(principal))
    await _applied(roster, event_handler)
    return await _view(database, clock, principal, team_id)


@router.post("/me/invitations/{invitation_id}/decline", status_code=204, responses=answers(UnknownInvitation))
async def decline_invitation(principal: Oneself, database: DatabaseDep, audit: AuditDep, invitation_id: Id) -> None:
    """Declines an invitation. The team is not notified."""
    async with database.writing() as session:
        await invitations.decline(session, principal, invitation_id, action=audit.action(principal))
