"""The rules of teams: who creates, changes and leaves them, and which drones are in them. Independent of HTTP.

No team learns of another: names of teams need not be unique, ids are random, people are invited by a name that is not
looked up (`invitations.py`), and for a user a team of others does not exist. Every rule takes a session of
`Database.writing()`, so that a change and its audit record are committed together.
"""

from __future__ import annotations

import secrets
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, Final

from sqlalchemy import delete, func, or_, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.accounts.store.users import UnknownUser, get_user
from server.audit.store.action import AuditAction
from server.control.store.tables import ControlLeaseRow
from server.fleet.store.drones import get_drone
from server.fleet.store.snapshot import begin_fleet_change, ties_of
from server.fleet.store.tables import LoanRow
from server.kernel.access import Action, Reach, UnknownDrone, reach_of
from server.kernel.names import clean_name
from server.kernel.people import Principal
from server.kernel.refusal import Refusal
from server.kernel.relations import Relation, TeamRole, relation_by_ties
from server.teams.core import (
    DroneInUse,
    InAnotherTeam,
    LastTeamAdmin,
    NotYourDrone,
    TeamAdminsOnly,
    TeamFull,
    TooManyTeams,
    UnknownTeam,
)
from server.teams.store.tables import TeamDroneRow, TeamMemberRow, TeamRow
from wire.ids import UserId

MAX_TEAMS: Final = 5
"""Teams that one user may create. Admins of the tower have no limit."""
MAX_MEMBERS: Final = 200
MAX_DRONES: Final = 200
DRONE_REMOVED: Final = "team.drone_removed"
MEMBER_REMOVED: Final = "team.member_removed"
ROLE_CHANGED: Final = "team.role_changed"
"""In the audit trail: an action that can revoke a user's right."""


@dataclass(frozen=True)
class TeamManager:
    """Who manages teams. `above`: an admin of the tower, or its command line; manages every team.

    `may_lead`: false for an account that only watches, whatever it is in a team.
    """

    user_id: UserId | None
    above: bool
    may_lead: bool = True

    @classmethod
    def of(cls, principal: Principal) -> TeamManager:
        """Returns the manager for a signed-in user."""
        leads = reach_of(principal.role, Action.LEAD_TEAMS)
        return cls(principal.user_id, leads is Reach.ALL, leads is not Reach.NONE)

    def leads(self, role: TeamRole | None) -> bool:
        """Whether they may change a team in which they have this role."""
        return self.above or (self.may_lead and role is TeamRole.ADMIN)


COMMAND_LINE: Final = TeamManager(None, above=True)


async def role_in(session: AsyncSession, team_id: int, user_id: int | None) -> TeamRole | None:
    """Returns the role of a user in a team; None: not a member."""
    row = await session.get(TeamMemberRow, (team_id, user_id)) if user_id is not None else None
    return TeamRole(row.role) if row is not None else None


async def list_teams(session: AsyncSession, manager: TeamManager) -> Sequence[TeamRow]:
    """Returns the teams of this user; for an admin of the tower, all teams."""
    query = select(TeamRow)
    if not manager.above:
        mine = select(TeamMemberRow.team_id).where(TeamMemberRow.user_id == manager.user_id)
        query = query.where(TeamRow.id.in_(mine))
    return (await session.scalars(query)).all()


async def find_teams(session: AsyncSession, *, name: str, team_id: int | None) -> Sequence[TeamRow]:
    """Returns the teams of this name, and the one with this id."""
    return (await session.scalars(select(TeamRow).where(or_(TeamRow.name == name, TeamRow.id == team_id)))).all()


async def team_names(session: AsyncSession, team_ids: Collection[int]) -> dict[int, str]:
    """Returns the names of those among these teams that exist."""
    query = select(TeamRow.id, TeamRow.name).where(TeamRow.id.in_(team_ids))
    return {row.id: row.name for row in await session.execute(query)}


async def get_team(session: AsyncSession, team_id: int, manager: TeamManager) -> TeamRow:
    """Returns a team visible to the manager. Raises UnknownTeam."""
    row = await session.get(TeamRow, team_id)
    if row is None or not (manager.above or await role_in(session, team_id, manager.user_id)):
        raise UnknownTeam
    return row


async def led_team(session: AsyncSession, team_id: int, manager: TeamManager) -> TeamRow:
    """Returns a team that the manager may change. Raises UnknownTeam, TeamAdminsOnly."""
    row = await get_team(session, team_id, manager)
    if not manager.leads(await role_in(session, team_id, manager.user_id)):
        raise TeamAdminsOnly
    return row


def new_id() -> int:
    """Returns a random id, which does not reveal how many exist."""
    return secrets.randbelow(2**31 - 1) + 1


async def make_team(session: AsyncSession, *, name: str, manager: TeamManager, action: AuditAction) -> TeamRow:
    """The creator becomes its admin, unless they are above all teams. Raises BadName, TooManyTeams."""
    name = clean_name(name)
    await begin_fleet_change(session)
    if not manager.above:
        made = await session.scalar(select(func.count()).where(TeamRow.made_by == manager.user_id))
        if (made or 0) >= MAX_TEAMS:
            raise TooManyTeams(MAX_TEAMS)
    row = TeamRow(id=new_id(), name=name, made_by=manager.user_id, created_at=action.at)
    session.add(row)
    await session.flush()
    action.record(session, "team.created", team_id=row.id, team=name)
    if not manager.above:
        session.add(TeamMemberRow(team_id=row.id, user_id=manager.user_id, role=TeamRole.ADMIN.value))
        await session.flush()
    return row


async def rename_team(
    session: AsyncSession, team_id: int, *, name: str, manager: TeamManager, action: AuditAction
) -> TeamRow:
    """Raises BadName, UnknownTeam, TeamAdminsOnly."""
    name = clean_name(name)
    await begin_fleet_change(session)
    row = await led_team(session, team_id, manager)
    if name != row.name:
        action.record(session, "team.renamed", team_id=row.id, team=name, before=row.name)
        row.name = name
    return row


async def delete_team(session: AsyncSession, team_id: int, *, manager: TeamManager, action: AuditAction) -> None:
    """Its drones belong to their owners alone again. Raises UnknownTeam, TeamAdminsOnly."""
    await begin_fleet_change(session)
    row = await led_team(session, team_id, manager)
    grouped = select(TeamDroneRow).where(TeamDroneRow.team_id == team_id)
    for one in await session.scalars(grouped.order_by(TeamDroneRow.drone_id)):
        action.record(session, DRONE_REMOVED, drone_id=one.drone_id, team_id=row.id, team=row.name)
    action.record(session, "team.deleted", team_id=row.id, team=row.name)
    await session.execute(delete(LoanRow).where(LoanRow.team_id == team_id))
    await session.delete(row)


# -- people --------------------------------------------------------------------------------------------------


async def set_role(
    session: AsyncSession, team_id: int, *, user_id: int, role: TeamRole, manager: TeamManager, action: AuditAction
) -> None:
    """Sets the role of a member. Only managers above all teams can add other users: a team admin invites.

    Raises UnknownTeam, TeamAdminsOnly, UnknownUser, LastTeamAdmin, TeamFull.
    """
    await begin_fleet_change(session)
    team = await led_team(session, team_id, manager)
    member = await session.get(TeamMemberRow, (team_id, user_id))
    if member is None:
        if not manager.above:
            raise UnknownUser
        await add_member(session, team, user=await get_user(session, user_id), role=role, action=action)
        return
    if member.role == role.value:
        return
    if role is not TeamRole.ADMIN:
        await _keep_an_admin(session, member, manager)
    before, member.role = member.role, role.value
    if role is not TeamRole.OBSERVER:
        await _end_loans(session, team_id, user_id=user_id)
    user = await get_user(session, user_id)
    about = _about(team, user)
    action.record(session, ROLE_CHANGED, **about, role=role.value, before=before)


async def add_member(
    session: AsyncSession, team: TeamRow, *, user: UserRow, role: TeamRole, action: AuditAction
) -> None:
    """Adds a user who is not a member yet. Raises TeamFull."""
    count = await session.scalar(select(func.count()).where(TeamMemberRow.team_id == team.id))
    if (count or 0) >= MAX_MEMBERS:
        raise TeamFull(f"a team has at most {MAX_MEMBERS} members")
    session.add(TeamMemberRow(team_id=team.id, user_id=user.id, role=role.value))
    about = _about(team, user)
    action.record(session, "team.member_added", **about, role=role.value)
    await session.flush()


async def remove_member(
    session: AsyncSession, team_id: int, *, user_id: int, manager: TeamManager, action: AuditAction
) -> None:
    """A team admin removes a member; any member may leave. The user loses drones on loan from the team.

    Raises UnknownTeam, TeamAdminsOnly, UnknownUser, LastTeamAdmin.
    """
    await begin_fleet_change(session)
    oneself = manager.user_id == user_id and await role_in(session, team_id, user_id) is not None
    team = await (get_team if oneself else led_team)(session, team_id, manager)
    member = await session.get(TeamMemberRow, (team_id, user_id))
    if member is None:
        raise UnknownUser
    await _keep_an_admin(session, member, manager)
    user = await get_user(session, user_id)
    await _end_loans(session, team_id, user_id=user_id)
    await session.delete(member)
    about = _about(team, user)
    action.record(session, MEMBER_REMOVED, **about, role=member.role)


def _about(team: TeamRow, user: UserRow) -> dict[str, Any]:
    return {"team_id": team.id, "team": team.name, "user_id": user.id, "user": user.name}


async def _keep_an_admin(session: AsyncSession, member: TeamMemberRow, manager: TeamManager) -> None:
    if member.role != TeamRole.ADMIN.value or manager.above:
        return
    others = select(func.count()).select_from(TeamMemberRow).join(UserRow, UserRow.id == TeamMemberRow.user_id)
    others = others.where(
        TeamMemberRow.team_id == member.team_id,
        TeamMemberRow.role == TeamRole.ADMIN.value,
        TeamMemberRow.user_id != member.user_id,
        UserRow.disabled.is_(False),
    )
    if not await session.scalar(others):
        raise LastTeamAdmin


async def _end_loans(
    session: AsyncSession, team_id: int, *, user_id: int | None = None, drone_id: int | None = None
) -> None:
    ended = delete(LoanRow).where(LoanRow.team_id == team_id)
    if user_id is not None:
        ended = ended.where(LoanRow.user_id == user_id)
    if drone_id is not None:
        ended = ended.where(LoanRow.drone_id == drone_id)
    await session.execute(ended)


# -- drones --------------------------------------------------------------------------------------------------


async def add_drone(
    session: AsyncSession, team_id: int, *, drone_id: int, manager: TeamManager, action: AuditAction
) -> None:
    """Adds a drone: by an owner of the drone who is an admin of the team. Repeating it changes nothing.

    Raises UnknownTeam, TeamAdminsOnly, UnknownDrone, NotYourDrone, InAnotherTeam, DroneInUse, TeamFull.
    """
    await begin_fleet_change(session)
    team = await led_team(session, team_id, manager)
    refused = await _why_not_theirs(session, drone_id, manager, action)
    if refused is not None:
        raise refused
    drone = await get_drone(session, drone_id)
    there = await session.get(TeamDroneRow, drone_id)
    if there is not None:
        if there.team_id != team_id:
            raise InAnotherTeam(drone.name)
        return
    count = await session.scalar(select(func.count()).where(TeamDroneRow.team_id == team_id))
    if (count or 0) >= MAX_DRONES:
        raise TeamFull(f"a team has at most {MAX_DRONES} drones")
    lease = await session.get(ControlLeaseRow, drone_id)
    if lease is not None:
        parts = {lease.holder_id, lease.taken_from_id, lease.assistant_id} - {None}
        inside = select(TeamMemberRow.user_id).where(TeamMemberRow.team_id == team_id)
        if parts - set(await session.scalars(inside)):
            raise DroneInUse(drone.name)
    session.add(TeamDroneRow(drone_id=drone_id, team_id=team_id, since=action.at))
    action.record(session, "team.drone_added", drone_id=drone_id, drone=drone.name, team_id=team.id, team=team.name)


async def remove_drone(
    session: AsyncSession, team_id: int, *, drone_id: int, manager: TeamManager, action: AuditAction
) -> None:
    """By a team admin, or by an owner of the drone in any role. Removing a drone that is not in the team changes
    nothing.

    Raises UnknownTeam, TeamAdminsOnly.
    """
    await begin_fleet_change(session)
    there = await session.get(TeamDroneRow, drone_id)
    here = there is not None and there.team_id == team_id
    owns = here and await _why_not_theirs(session, drone_id, manager, action) is None
    if not owns:
        await led_team(session, team_id, manager)
    team = await session.get(TeamRow, team_id)
    if there is None or not here or team is None:
        return
    drone = await get_drone(session, drone_id)
    await _end_loans(session, team_id, drone_id=drone_id)
    await session.delete(there)
    action.record(session, DRONE_REMOVED, drone_id=drone_id, drone=drone.name, team_id=team.id, team=team.name)


async def _why_not_theirs(
    session: AsyncSession, drone_id: int, manager: TeamManager, action: AuditAction
) -> Refusal | None:
    """Returns why the manager may not decide on the drone's team, or None."""
    drone = await get_drone(session, drone_id)
    if manager.above:
        return None
    ties = await ties_of(session, drone_id, action.at)
    if manager.user_id in ties.owners:
        return None
    stranger = manager.user_id is None or relation_by_ties(ties, manager.user_id) is Relation.STRANGER
    return UnknownDrone() if stranger else NotYourDrone(drone.name)
