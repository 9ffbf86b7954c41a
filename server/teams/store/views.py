"""How members see a team: observers see less about the people than pilots do."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.fleet.core.views import UserRefView
from server.fleet.store.tables import DroneRow
from server.kernel.relations import TeamRole
from server.storage.in_slices import slices
from server.teams.store.invitations import Received
from server.teams.store.tables import TeamDroneRow, TeamInvitationRow, TeamMemberRow, TeamRow
from server.teams.store.teams import TeamManager


class MemberView(BaseModel):
    """A member of the team."""

    model_config = ConfigDict(frozen=True)

    user: UserRefView
    role: TeamRole


class TeamDroneView(BaseModel):
    """A drone of the team."""

    model_config = ConfigDict(frozen=True)

    id: int
    name: str


class InvitationView(BaseModel):
    """An invitation for this name, whether or not a user has it."""

    model_config = ConfigDict(frozen=True)

    id: int
    name: str
    role: TeamRole
    invited_at: datetime
    expires_at: datetime

    @classmethod
    def of(cls, row: TeamInvitationRow) -> InvitationView:
        return cls(
            id=row.id,
            name=row.name,
            role=TeamRole(row.role),
            invited_at=row.created_at,
            expires_at=row.expires_at,
        )


class ReceivedView(BaseModel):
    """An invitation, as the invited person sees it."""

    model_config = ConfigDict(frozen=True)

    id: int
    team: Annotated[str, Field(description="Name of the team")]
    role: TeamRole
    invited_by: str
    expires_at: datetime

    @classmethod
    def of(cls, one: Received) -> ReceivedView:
        row = one.row
        return cls(
            id=row.id,
            team=one.team,
            role=TeamRole(row.role),
            invited_by=row.invited_by,
            expires_at=row.expires_at,
        )


class TeamView(BaseModel):
    """A team, as a member or an admin of the tower sees it."""

    model_config = ConfigDict(frozen=True)

    id: int
    name: str
    role: Annotated[TeamRole | None, Field(description="Your role; null: you are an admin of the tower and no member")]
    members: Annotated[list[MemberView], Field(description="Observers see only its admins and themselves")]
    drones: list[TeamDroneView]
    invitations: Annotated[list[InvitationView], Field(description="Only for its admins")]


async def views_of(
    session: AsyncSession, teams: Iterable[TeamRow], manager: TeamManager, at: datetime
) -> list[TeamView]:
    """Returns the teams as `manager` sees them, by name."""
    rows = sorted(teams, key=lambda team: (team.name.casefold(), team.id))
    ids = [row.id for row in rows]
    people = select(TeamMemberRow.team_id, TeamMemberRow.role, UserRow.id, UserRow.name)
    people = people.join(UserRow, UserRow.id == TeamMemberRow.user_id).where(TeamMemberRow.team_id.in_(ids))
    members: defaultdict[int, list[MemberView]] = defaultdict(list)
    async for some in slices(session, people.order_by(UserRow.name, UserRow.id)):
        for one in some:
            user = UserRefView(id=one.id, name=one.name)
            members[one.team_id].append(MemberView(user=user, role=TeamRole(one.role)))
    grouped = select(TeamDroneRow.team_id, DroneRow.id, DroneRow.name)
    grouped = grouped.join(DroneRow, DroneRow.id == TeamDroneRow.drone_id).where(TeamDroneRow.team_id.in_(ids))
    drones: defaultdict[int, list[TeamDroneView]] = defaultdict(list)
    for drone in await session.execute(grouped.order_by(DroneRow.id)):
        drones[drone.team_id].append(TeamDroneView(id=drone.id, name=drone.name))
    asked = select(TeamInvitationRow).where(TeamInvitationRow.team_id.in_(ids), TeamInvitationRow.expires_at > at)
    invitations: defaultdict[int, list[InvitationView]] = defaultdict(list)
    for row in await session.scalars(asked.order_by(TeamInvitationRow.created_at, TeamInvitationRow.id)):
        invitations[row.team_id].append(InvitationView.of(row))
    return [_view(row, members[row.id], drones[row.id], invitations[row.id], manager) for row in rows]


def _view(
    row: TeamRow,
    members: list[MemberView],
    drones: list[TeamDroneView],
    invitations: list[InvitationView],
    manager: TeamManager,
) -> TeamView:
    role = next((one.role for one in members if one.user.id == manager.user_id), None)
    sees_everybody = manager.above or role in (TeamRole.OPERATOR, TeamRole.ADMIN)
    leads = manager.leads(role)
    return TeamView(
        id=row.id,
        name=row.name,
        role=role,
        members=[
            one for one in members if sees_everybody or one.role is TeamRole.ADMIN or one.user.id == manager.user_id
        ],
        drones=drones,
        invitations=invitations if leads else [],
    )
