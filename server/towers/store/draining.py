"""The running towers for people, and the wish that one of them ends its work. The tower reads it with its renewal."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.action import AuditAction
from server.kernel.tower_refusals import LastTower, UnknownTower
from server.towers.store.tables import TowerMemberRow

NAMED_BY: int = 8
"""The letters of its number by which people know a tower."""


@dataclass(frozen=True)
class RunningTower:
    """`name`: the first letters of its number."""

    tower: str
    address: str
    url: str
    host: str
    pid: int
    joined_at: datetime
    draining: bool
    doing: str

    @property
    def name(self) -> str:
        return self.tower[:NAMED_BY]


def _of(row: TowerMemberRow) -> RunningTower:
    return RunningTower(row.tower, row.address, row.url, row.host, row.pid, row.joined_at, row.draining, row.doing)


async def running_towers(session: AsyncSession) -> list[RunningTower]:
    """In the order in which they have joined. Empty without a bus."""
    rows = await session.scalars(select(TowerMemberRow).order_by(TowerMemberRow.joined_at, TowerMemberRow.tower))
    return [_of(row) for row in rows]


async def ask_to_drain(session: AsyncSession, named: str, action: AuditAction) -> RunningTower:
    """`named`: the first letters of its number, or its address. It begins within a second. Raises UnknownTower,
    LastTower."""
    rows = list(await session.scalars(select(TowerMemberRow).order_by(TowerMemberRow.tower).with_for_update()))
    found = [one for one in rows if named and (one.tower.startswith(named) or named in (one.address, one.url))]
    if len(found) != 1:
        raise UnknownTower("there is no such tower" if not found else "several towers begin with these letters")
    row = found[0]
    if not any(one for one in rows if one is not row and not one.draining):
        raise LastTower("no other tower would take its drones: start another one first")
    if not row.draining:
        row.draining = True
        action.record(session, "tower.drain_asked", tower=row.tower[:NAMED_BY], address=row.address)
    return _of(row)
