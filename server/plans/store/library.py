"""The rules of the mission library: who sees and changes missions, how many there may be, and conflicting changes.

Users always see their own missions. Users who share a team with the owner also see a shared mission; users without a
team see those of owners without a team. All users see an admin's shared missions, and admins see all shared missions.
The owner and admins may change a mission. A mission that a user may not see does not exist for that user. Every rule
takes a session of the database: a change and its audit record are committed together.
"""

from __future__ import annotations

from typing import Final

from sqlalchemy import ColumnElement, and_, func, or_, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.audit.store.action import AuditAction
from server.kernel.access import Action, Reach, reaches, reaches_all, roles_with
from server.kernel.names import clean_name
from server.kernel.people import Principal
from server.kernel.refusal import Refusal
from server.plans.core.document import KeptDocument
from server.plans.store.tables import MissionRow
from server.teams.store.tables import TeamMemberRow
from wire.ids import UserId

MAX_MISSIONS: Final = 500


class UnknownMission(Refusal):
    """The mission does not exist, or this user may not see it."""

    def __init__(self) -> None:
        super().__init__("there is no such mission")


class NotYourMission(Refusal):
    def __init__(self) -> None:
        super().__init__("only its owner or an admin can change this mission: keep a copy of your own")


class TooManyMissions(Refusal):
    def __init__(self) -> None:
        super().__init__(f"at most {MAX_MISSIONS} missions are kept for a user")


class ChangedMeanwhile(Refusal):
    def __init__(self, version: int) -> None:
        super().__init__(f"somebody else has changed this mission: it is at version {version}")


class VersionNeeded(Refusal):
    def __init__(self) -> None:
        super().__init__("send If-Match with the version to replace")


Found = tuple[MissionRow, str]
"""The mission with the name of its owner."""


def _seen_by(viewer: Principal) -> ColumnElement[bool]:
    """Condition of a query on missions joined with their owners: the missions that this user may see."""
    own = MissionRow.owner_id == viewer.user_id
    if reaches_all(viewer.role, Action.SEE_MISSIONS):
        return or_(own, MissionRow.shared)
    teams = select(TeamMemberRow.team_id).where(TeamMemberRow.user_id == viewer.user_id)
    mates = select(TeamMemberRow.user_id).where(TeamMemberRow.team_id.in_(teams))
    in_no_team = and_(~teams.exists(), MissionRow.owner_id.not_in(select(TeamMemberRow.user_id)))
    for_everybody = UserRow.role.in_(roles_with(Action.SHARE_WITH_EVERYBODY, Reach.ALL))
    near = or_(for_everybody, MissionRow.owner_id.in_(mates), in_no_team)
    return or_(own, and_(MissionRow.shared, near))


async def list_missions(session: AsyncSession, viewer: Principal) -> list[Found]:
    """The user's own and visible shared missions, newest first, without their documents."""
    query = select(MissionRow, UserRow.name).join(UserRow, UserRow.id == MissionRow.owner_id)
    rows = await session.execute(
        query.where(_seen_by(viewer)).order_by(MissionRow.updated_at.desc(), MissionRow.id.desc())
    )
    return [(row, name) for row, name in rows]


async def get_mission(session: AsyncSession, viewer: Principal, mission_id: int, *, lock: bool = False) -> Found:
    """Raises UnknownMission."""
    query = select(MissionRow, UserRow.name).join(UserRow, UserRow.id == MissionRow.owner_id)
    query = query.where(MissionRow.id == mission_id, _seen_by(viewer))
    if lock:
        query = query.with_for_update(of=MissionRow)
    found = (await session.execute(query)).first()
    if found is None:
        raise UnknownMission
    return found[0], found[1]


async def document_of(session: AsyncSession, row: MissionRow) -> str:
    """Its plan as JSON."""
    return (await session.scalars(select(MissionRow.document).where(MissionRow.id == row.id))).one()


async def create_mission(
    session: AsyncSession, viewer: Principal, *, name: str, document: KeptDocument, shared: bool, action: AuditAction
) -> Found:
    """Raises BadName, TooManyMissions."""
    name = clean_name(name)
    # Two at the same time must not both take the last place.
    await session.execute(select(UserRow.id).where(UserRow.id == viewer.user_id).with_for_update())
    count = await session.scalar(select(func.count()).where(MissionRow.owner_id == viewer.user_id))
    if (count or 0) >= MAX_MISSIONS:
        raise TooManyMissions
    row = MissionRow(owner_id=viewer.user_id, version=1)
    _fill(row, name=name, document=document, shared=shared, action=action)
    session.add(row)
    await session.flush()
    action.record(session, "mission.created", mission_id=row.id, mission=name, shared=shared)
    return row, viewer.name


async def replace_mission(
    session: AsyncSession,
    viewer: Principal,
    mission_id: int,
    *,
    version: int | None,
    name: str,
    document: KeptDocument,
    shared: bool,
    action: AuditAction,
) -> Found:
    """`version`: the one to be replaced. Raises UnknownMission, NotYourMission, VersionNeeded, ChangedMeanwhile,
    BadName."""
    row, owner = await _to_change(session, viewer, mission_id)
    if version is None:
        raise VersionNeeded
    if version != row.version:
        raise ChangedMeanwhile(row.version)
    _fill(row, name=clean_name(name), document=document, shared=shared, action=action)
    row.version += 1
    action.record(
        session, "mission.changed", mission_id=row.id, mission=row.name, shared=shared, version=row.version, owner=owner
    )
    return row, owner


async def delete_mission(session: AsyncSession, viewer: Principal, mission_id: int, *, action: AuditAction) -> None:
    """Raises UnknownMission, NotYourMission."""
    row, owner = await _to_change(session, viewer, mission_id)
    action.record(session, "mission.deleted", mission_id=row.id, mission=row.name, owner=owner)
    await session.delete(row)


async def _to_change(session: AsyncSession, viewer: Principal, mission_id: int) -> Found:
    row, owner = await get_mission(session, viewer, mission_id, lock=True)
    if not reaches(viewer, Action.CHANGE_MISSIONS, UserId(row.owner_id)):
        raise NotYourMission
    return row, owner


def _fill(row: MissionRow, *, name: str, document: KeptDocument, shared: bool, action: AuditAction) -> None:
    row.name, row.document, row.shared, row.updated_at = name, document.text, shared, action.at
    row.mission_items, row.fence_items, row.rally_items = document.counts
