"""`/api/v1/shares`: who uses how much of what all share, and the limits, for admins."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any, Final

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from server.alerts.core.announcer import Announcer
from server.alerts.store.channels.outbox import waiting_by_drone
from server.alerts.store.writer import AlertWriter
from server.fleet.store.share_limits import change_limit, chosen_limits
from server.fleet.store.tables import ShareLimitRow
from server.flights.api.import_routes import FlightImportsDep
from server.flights.store.imports.service import FlightImports
from server.http.access import Admin
from server.http.dependencies import (
    AlertWriterDep,
    AnnouncerDep,
    AuditDep,
    DatabaseDep,
    HubDep,
    RosterDep,
    SideThreadDep,
)
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired
from server.kernel.shares import SHARES, BadShareLimit, ShareName, Whose
from server.live.hub import Hub
from server.runtime.side_thread import SideThread
from server.storage.database import Database
from server.teams.store.teams import team_names
from wire.ids import DroneId, UserId

router = APIRouter(prefix="/api/v1/shares", tags=["system"], responses=answers(NotSignedIn, SessionExpired, AdminsOnly))
SHOWN: Final = 20
"""Of one share: those who use most."""
_Used = Mapping[ShareName, Mapping[Any, int]]
"""By number of the person, drone or team; None or 0: the tower itself."""


class UseView(BaseModel):
    id: Annotated[int | None, Field(description="Of the person, drone or team; null: the tower itself, or all")]
    name: str
    used: int


class SharedView(BaseModel):
    name: ShareName
    what: str
    whose: Whose
    beyond: Annotated[str, Field(description="What happens to who asks for more")]
    limit: int
    default: int
    least: int
    most: int
    changed_by: Annotated[str | None, Field(description="The admin who chose the limit; null: it is the default")]
    changed_at: datetime | None
    over_time: Annotated[bool, Field(description="`used` is that of the last minute or two, and not of now")]
    used: Annotated[list[UseView], Field(description=f"Who uses most of it at this tower, at most {SHOWN}")]


class NewLimit(BaseModel):
    model_config = ConfigDict(extra="forbid")

    limit: Annotated[int | None, Field(description="null: the default")]


@router.get("")
async def list_shares(
    admin: Admin,
    database: DatabaseDep,
    hub: HubDep,
    side: SideThreadDep,
    announcer: AnnouncerDep,
    alert_writer: AlertWriterDep,
    imports: FlightImportsDep,
) -> list[SharedView]:
    """Lists what people, drones and teams share: the limit of each share, and who uses most of it at this tower."""
    used = await _used(database, hub, side, announcer, alert_writer, imports)
    return await _views(database, hub, used)


@router.put("/{share_name}", responses=answers(BadShareLimit))
async def change_share(
    admin: Admin,
    database: DatabaseDep,
    audit: AuditDep,
    roster: RosterDep,
    hub: HubDep,
    share_name: ShareName,
    body: NewLimit,
) -> SharedView:
    """Changes the limit of a share, at every tower within a second. What is used already stays. The answer says nothing
    of who uses it."""
    async with database.writing() as session:
        default = hub.state.shares.default(share_name)
        await change_limit(session, share_name, body.limit, default=default, action=audit.action(admin))
    await roster.refresh()
    return next(one for one in await _views(database, hub, {}) if one.name is share_name)


async def _used(
    database: Database,
    hub: Hub,
    side: SideThread,
    announcer: Announcer,
    alert_writer: AlertWriter,
    imports: FlightImports,
) -> _Used:
    async with database.reading() as session:
        deliveries = await waiting_by_drone(session)
    zones = hub.zones.count_by_team()
    used: dict[ShareName, Mapping[Any, int]] = {
        ShareName.WORK: side.waiting(),
        ShareName.IMPORTS: await imports.count_by_person(),
        ShareName.ZONES: {team: count for team, count in zones.items() if team is not None},
        ShareName.ZONES_OF_TEAMS: {None: sum(count for team, count in zones.items() if team is not None)},
        ShareName.ANNOUNCEMENTS: announcer.waiting(),
        ShareName.DELIVERIES: deliveries,
        ShareName.ALERTS: alert_writer.waiting_by_drone(),
        ShareName.AIRCRAFT: hub.aircraft.table.heard_by_drone(),
    }
    for share in SHARES.values():
        if share.over_time:
            used[share.name] = hub.state.shares.used(share.name)
    return used


async def _views(database: Database, hub: Hub, used: _Used) -> list[SharedView]:
    async with database.reading() as session:
        chosen = {row.name: row for row in await chosen_limits(session)}
        teams = await team_names(session, list(used.get(ShareName.ZONES, {})))
    return [_view(name, hub, teams, chosen.get(name), used.get(name, {})) for name in SHARES]


def _view(
    name: ShareName, hub: Hub, teams: Mapping[int, str], chosen: ShareLimitRow | None, used: Mapping[int | None, int]
) -> SharedView:
    share = SHARES[name]

    def name_of(whose: int | None) -> str:
        if not whose:
            return "all together" if share.whose is Whose.TOWER else "the tower"
        if share.whose is Whose.PERSON:
            return hub.fleet.name_of(UserId(whose))
        if share.whose is Whose.TEAM:
            return teams.get(whose, "")
        drone = hub.state.drones.get(DroneId(whose))
        return "" if drone is None else drone.record.name

    most = Counter({whose: count for whose, count in used.items() if count}).most_common(SHOWN)
    return SharedView(
        name=name,
        what=share.what,
        whose=share.whose,
        beyond=share.beyond,
        limit=hub.state.shares.limit(name),
        default=hub.state.shares.default(name),
        least=share.least,
        most=share.most,
        changed_by=chosen.changed_by if chosen else None,
        changed_at=chosen.changed_at if chosen else None,
        over_time=share.over_time,
        used=[UseView(id=whose or None, name=name_of(whose), used=count) for whose, count in most],
    )
