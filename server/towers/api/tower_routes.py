"""`/api/v1/system/towers`: the towers of one database, and how one of them ends its work. For admins."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Path
from pydantic import BaseModel, Field

from server.http.access import Admin, ProvedAdmin
from server.http.dependencies import AuditDep, DatabaseDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired
from server.kernel.tower_refusals import LastTower, UnknownTower
from server.towers.store.draining import RunningTower, ask_to_drain, running_towers

router = APIRouter(prefix="/api/v1/system/towers", tags=["system"])
TowerPath = Annotated[str, Path(min_length=4, max_length=32, pattern="^[0-9a-f]+$")]


class TowerView(BaseModel):
    """One of several towers on one database."""

    id: Annotated[str, Field(description="The first letters of its number")]
    address: str
    own_url: Annotated[str, Field(description="Where agents reach this tower alone; empty: through a proxy only")]
    host: str
    joined_at: datetime
    draining: Annotated[bool, Field(description="It ends its work")]
    doing: Annotated[str, Field(description="How far it is with that, in words")]


def _view(one: RunningTower) -> TowerView:
    return TowerView(
        id=one.name,
        address=one.address,
        own_url=one.url,
        host=one.host,
        joined_at=one.joined_at,
        draining=one.draining,
        doing=one.doing,
    )


@router.get("", responses=answers(NotSignedIn, SessionExpired, AdminsOnly))
async def list_towers(admin: Admin, database: DatabaseDep) -> list[TowerView]:
    """Lists the running towers that share the database. Empty for a tower without a bus."""
    async with database.reading() as session:
        return [_view(one) for one in await running_towers(session)]


@router.post(
    "/{tower_id}/drain",
    status_code=202,
    responses=answers(NotSignedIn, SessionExpired, AdminsOnly, UnknownTower, LastTower),
)
async def drain_tower(admin: ProvedAdmin, database: DatabaseDep, audit: AuditDep, tower_id: TowerPath) -> TowerView:
    """Lets a tower end its work: its drones and browsers move to the others, hand-flown ones last, then it exits."""
    async with database.writing() as session:
        return _view(await ask_to_drain(session, tower_id, audit.action(admin)))
