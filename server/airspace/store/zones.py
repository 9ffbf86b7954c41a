"""The rules of zones: who draws, changes and deletes them. Independent of HTTP.

Admins of the tower change every zone; an admin of a team changes those of the team. A zone that a user may not see does
not exist for that user. Every rule takes a session of `Database.writing()`, so that a change and its audit record are
committed together.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

import msgspec
from sqlalchemy import Row, func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.airspace.core.zones.zone import MAX_ZONES
from server.airspace.store.tables import ZoneRow
from server.audit.store.action import AuditAction
from server.kernel.access import Action, AdminsOnly, Reach, roles_with
from server.kernel.refusal import Refusal
from server.kernel.shares import ShareName, Shares
from server.teams.store.tables import TeamMemberRow, TeamRow
from server.teams.store.teams import TeamManager, get_team, led_team, new_id
from wire.zones.kinds import HeightAbove, ZoneKind, ZoneRule
from wire.zones.zone import Zone, ZoneShape

VERSIONS = select(func.count(ZoneRow.id), func.coalesce(func.sum(ZoneRow.version), 0), func.max(ZoneRow.updated_at))
"""Changes with each change of a zone."""
NUMBERED = select(ZoneRow.id, ZoneRow.version)


class UnknownZone(Refusal):
    """The zone does not exist, or this user may not see it."""

    def __init__(self) -> None:
        super().__init__("there is no such zone")


class TooManyZones(Refusal):
    def __init__(self, *, of_a_team: int = 0, of_teams: int = 0) -> None:
        """The limit that was reached."""
        if of_a_team:
            words = f"a team, or all teams that one person has made, may have {of_a_team} zones"
        elif of_teams:
            words = f"all teams together may have {of_teams} zones, and they have them: ask an admin of the tower"
        else:
            words = f"the tower keeps at most {MAX_ZONES} zones"
        super().__init__(f"{words}: delete some first")


class ZoneChangedMeanwhile(Refusal):
    def __init__(self, version: int) -> None:
        super().__init__(f"somebody else has changed this zone: it is at version {version}")


def zone_of(row: ZoneRow | Row[Any]) -> Zone:
    points = msgspec.json.decode(row.points, type=tuple[tuple[float, float], ...])
    return Zone(
        id=row.id,
        name=row.name,
        kind=ZoneKind(row.kind),
        rule=ZoneRule(row.rule),
        shape=ZoneShape(points=points, width_m=row.width_m),
        team_id=row.team_id,
        floor_m=row.floor_m,
        ceiling_m=row.ceiling_m,
        height_above=HeightAbove(row.height_above),
        valid_from=row.valid_from,
        valid_until=row.valid_until,
        reason=row.reason,
        version=row.version,
    )


async def rows_of(session: AsyncSession, zone_ids: Iterable[int]) -> list[Row[Any]]:
    """The columns of these zones, for `zone_of`."""
    wanted = sorted(zone_ids)
    if not wanted:
        return []
    return list(await session.execute(select(*ZoneRow.__table__.columns).where(ZoneRow.id.in_(wanted))))


async def teams_of(session: AsyncSession, user_id: int) -> frozenset[int]:
    """The teams that this user is in."""
    return frozenset(await session.scalars(select(TeamMemberRow.team_id).where(TeamMemberRow.user_id == user_id)))


async def create_zone(
    session: AsyncSession, zone: Zone, *, manager: TeamManager, action: AuditAction, shares: Shares
) -> Zone:
    """The zone with its id. `zone`: a checked one. Raises AdminsOnly, UnknownTeam, TeamAdminsOnly, TooManyZones."""
    await _require_right(session, zone.team_id, manager)
    await _require_room(session, zone.team_id, shares)
    row = ZoneRow(id=new_id(), version=1)
    _fill(row, zone, action)
    session.add(row)
    await session.flush()
    action.record(session, "zone.created", **_about(zone_of(row)))
    return zone_of(row)


async def replace_zone(
    session: AsyncSession, zone_id: int, zone: Zone, *, manager: TeamManager, action: AuditAction, shares: Shares
) -> Zone:
    """`zone.version`: the one to be replaced. Raises what `create_zone` does, UnknownZone, ZoneChangedMeanwhile."""
    row = await _to_change(session, zone_id, manager)
    await _require_right(session, zone.team_id, manager)
    if zone.version != row.version:
        raise ZoneChangedMeanwhile(row.version)
    if zone.team_id != row.team_id:
        await _require_room(session, zone.team_id, shares)
    before = _about(zone_of(row))
    _fill(row, zone, action)
    row.version += 1
    after = _about(zone_of(row))
    changed = {key: value for key, value in before.items() if after[key] != value}
    action.record(session, "zone.changed", **after, before=changed)
    await session.flush()
    return zone_of(row)


async def delete_zone(session: AsyncSession, zone_id: int, *, manager: TeamManager, action: AuditAction) -> None:
    """Raises UnknownZone, AdminsOnly, TeamAdminsOnly."""
    row = await _to_change(session, zone_id, manager)
    action.record(session, "zone.deleted", **_about(zone_of(row)))
    await session.delete(row)


async def _to_change(session: AsyncSession, zone_id: int, manager: TeamManager) -> ZoneRow:
    row = await session.get(ZoneRow, zone_id, with_for_update=True)
    if row is None:
        raise UnknownZone
    if row.team_id is not None and not manager.above:
        try:
            await get_team(session, row.team_id, manager)
        except Refusal:
            raise UnknownZone from None
    await _require_right(session, row.team_id, manager)
    return row


async def _require_right(session: AsyncSession, team_id: int | None, manager: TeamManager) -> None:
    if team_id is not None:
        await led_team(session, team_id, manager)
    elif not manager.above:
        raise AdminsOnly


async def _require_room(session: AsyncSession, team_id: int | None, shares: Shares) -> None:
    """For one zone more of the team; None: of the tower. Raises TooManyZones."""
    whole, of_teams = (await session.execute(select(func.count(ZoneRow.id), func.count(ZoneRow.team_id)))).one()
    if whole >= MAX_ZONES:
        raise TooManyZones
    if team_id is None:
        return
    all_teams, a_team = shares.limit(ShareName.ZONES_OF_TEAMS), shares.limit(ShareName.ZONES)
    if of_teams >= all_teams:
        raise TooManyZones(of_teams=all_teams)
    made_by = await session.scalar(
        select(UserRow.id)
        .join(TeamRow, TeamRow.made_by == UserRow.id)
        .where(TeamRow.id == team_id, UserRow.role.not_in(roles_with(Action.LEAD_TEAMS, Reach.ALL)))
    )
    share = select(func.count(ZoneRow.id))
    if made_by is None:
        share = share.where(ZoneRow.team_id == team_id)
    else:
        share = share.join(TeamRow, TeamRow.id == ZoneRow.team_id).where(TeamRow.made_by == made_by)
    if (await session.scalar(share) or 0) >= a_team:
        raise TooManyZones(of_a_team=a_team)


def _fill(row: ZoneRow, zone: Zone, action: AuditAction) -> None:
    row.team_id, row.name, row.kind, row.rule = zone.team_id, zone.name, zone.kind.value, zone.rule.value
    row.points, row.width_m = msgspec.json.encode(zone.shape.points).decode(), zone.shape.width_m
    row.floor_m, row.ceiling_m, row.height_above = zone.floor_m, zone.ceiling_m, zone.height_above.value
    row.valid_from, row.valid_until, row.reason = zone.valid_from, zone.valid_until, zone.reason
    row.made_by, row.updated_at = action.by.name, action.at


def _about(zone: Zone) -> dict[str, Any]:
    def said(at: datetime | None) -> str | None:
        return None if at is None else at.isoformat()

    points: Sequence[tuple[float, float]] = zone.shape.points
    return {
        "zone_id": zone.id,
        "zone": zone.name,
        "kind": zone.kind.value,
        "rule": zone.rule.value,
        "team_id": zone.team_id,
        "points": len(points),
        "first_point": list(points[0]),
        "width_m": zone.shape.width_m,
        "floor_m": zone.floor_m,
        "ceiling_m": zone.ceiling_m,
        "height_above": zone.height_above.value,
        "valid_from": said(zone.valid_from),
        "valid_until": said(zone.valid_until),
        "reason": zone.reason,
    }
