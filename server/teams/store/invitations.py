"""Invitations into a team by name, so that a team admin does not learn which users exist.

An invitation is stored under the typed name, without checking whether a user has it. The team sees "invited" until it
is accepted, withdrawn or expired: declining looks the same as a name that no user has.
"""

from __future__ import annotations

from datetime import timedelta
from typing import Final, NamedTuple

from sqlalchemy import delete, func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.users import get_user
from server.audit.store.action import AuditAction
from server.fleet.store.snapshot import begin_fleet_change
from server.kernel.names import clean_name, name_key
from server.kernel.people import Principal
from server.kernel.relations import TeamRole
from server.teams.core import MemberAlready, TeamFull, UnknownInvitation
from server.teams.store.tables import TeamInvitationRow, TeamMemberRow, TeamRow
from server.teams.store.teams import TeamManager, add_member, led_team, new_id, role_in

LASTS: Final = timedelta(days=7)
MAX_INVITATIONS: Final = 50
"""Per team, not counting expired ones."""


class Received(NamedTuple):
    """An invitation with the name of the team."""

    row: TeamInvitationRow
    team: str


async def invite(
    session: AsyncSession, team_id: int, *, name: str, role: TeamRole, manager: TeamManager, action: AuditAction
) -> TeamInvitationRow:
    """Inviting a name that is already invited changes nothing: withdraw the invitation first to repeat it.

    Raises BadName, UnknownTeam, TeamAdminsOnly, MemberAlready (a team admin knows the members), TeamFull.
    """
    name = clean_name(name)
    await begin_fleet_change(session)
    team = await led_team(session, team_id, manager)
    await session.execute(delete(TeamInvitationRow).where(TeamInvitationRow.expires_at <= action.at))
    members = select(TeamMemberRow.user_id).where(TeamMemberRow.team_id == team_id)
    for user_id in await session.scalars(members):
        if (await get_user(session, user_id)).name_key == name_key(name):
            raise MemberAlready
    same = select(TeamInvitationRow).where(
        TeamInvitationRow.team_id == team_id, TeamInvitationRow.name_key == name_key(name)
    )
    row = await session.scalar(same)
    if row is not None:
        return row
    count = await session.scalar(select(func.count()).where(TeamInvitationRow.team_id == team_id))
    if (count or 0) >= MAX_INVITATIONS:
        raise TeamFull(f"a team has at most {MAX_INVITATIONS} invitations at a time")
    row = TeamInvitationRow(
        id=new_id(),
        team_id=team_id,
        name=name,
        name_key=name_key(name),
        role=role.value,
        invited_by=getattr(action.by, "name", ""),
        created_at=action.at,
        expires_at=action.at + LASTS,
    )
    session.add(row)
    action.record(session, "team.invited", team_id=team.id, team=team.name, name=name, role=role.value)
    await session.flush()
    return row


async def withdraw(
    session: AsyncSession, team_id: int, invitation_id: int, *, manager: TeamManager, action: AuditAction
) -> None:
    """Raises UnknownTeam, TeamAdminsOnly, UnknownInvitation."""
    team = await led_team(session, team_id, manager)
    row = await session.get(TeamInvitationRow, invitation_id)
    if row is None or row.team_id != team_id or row.expires_at <= action.at:
        raise UnknownInvitation
    await session.delete(row)
    action.record(session, "team.invitation_withdrawn", team_id=team.id, team=team.name, name=row.name)


async def received(session: AsyncSession, principal: Principal, action: AuditAction) -> list[Received]:
    """Returns the open invitations for this user, newest first."""
    user = await get_user(session, principal.user_id)
    query = select(TeamInvitationRow, TeamRow.name).join(TeamRow, TeamRow.id == TeamInvitationRow.team_id)
    query = query.where(
        TeamInvitationRow.name_key == user.name_key,
        TeamInvitationRow.declined.is_(False),
        TeamInvitationRow.expires_at > action.at,
    )
    rows = await session.execute(query.order_by(TeamInvitationRow.created_at.desc(), TeamInvitationRow.id))
    return [Received(row, team) for row, team in rows]


async def accept(session: AsyncSession, principal: Principal, invitation_id: int, *, action: AuditAction) -> int:
    """Returns the id of the team that the user is now in. Raises UnknownInvitation, TeamFull."""
    await begin_fleet_change(session)
    row = await _for_them(session, principal, invitation_id, action)
    team = await session.get(TeamRow, row.team_id)
    assert team is not None  # deleting a team deletes its invitations
    if await role_in(session, team.id, principal.user_id) is None:
        user = await get_user(session, principal.user_id)
        await add_member(session, team, user=user, role=TeamRole(row.role), action=action)
    await session.delete(row)
    return team.id


async def decline(session: AsyncSession, principal: Principal, invitation_id: int, *, action: AuditAction) -> None:
    """The team is not notified. Raises UnknownInvitation."""
    row = await _for_them(session, principal, invitation_id, action)
    row.declined = True
    action.record(session, "team.invitation_declined", team_id=row.team_id, name=row.name)


async def _for_them(
    session: AsyncSession, principal: Principal, invitation_id: int, action: AuditAction
) -> TeamInvitationRow:
    for one in await received(session, principal, action):
        if one.row.id == invitation_id:
            return one.row
    raise UnknownInvitation
