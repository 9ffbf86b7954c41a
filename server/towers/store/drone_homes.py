"""Which tower is the home of a drone: claimed and checked in the database, in the transaction that changes the lease.

So of two towers only the home ever changes a lease, whatever the bus has told them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Final

from sqlalchemy import Executable, Text, func, or_, select, union_all
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.audit.store.trail import TOWER, record
from server.control.core.lease import TOWER as THE_TOWER
from server.control.core.lease import Changed, Event, Refused, decide
from server.control.store.lease_store import lease_of_row, view_of
from server.control.store.loss_checks import read_acknowledged_of
from server.control.store.settings_store import read_settings_of
from server.control.store.tables import ControlLeaseRow
from server.kernel.clock import Clock
from server.kernel.drone_settings import DroneSettings
from server.live.live_drone import LeaseView
from server.storage.database import Database, DatabaseSession
from server.towers.store.claim_batches import ClaimBatches
from server.towers.store.tables import DroneHomeRow, TowerMemberRow
from wire.ids import DroneId, UserId

AT_ANOTHER_TOWER: Final = Refused(
    "at-another-tower", "another tower has this drone, and it alone changes who has the controls: try again"
)


@dataclass(frozen=True)
class Claimed:
    """`claim`: its number. `moved`: it was another tower's, or nobody's. `lease`: None for a drone that never had
    one. `settings`, and `acknowledged` dangers by user, are as in the same transaction."""

    claim: int
    moved: bool
    lease: LeaseView | None
    hold_open: bool
    settings: DroneSettings = field(default_factory=DroneSettings)
    acknowledged: dict[UserId, str] = field(default_factory=dict)


class DroneHomes:
    """The homes of one tower that shares a bus."""

    def __init__(self, database: Database, clock: Clock, tower: str) -> None:
        self._database = database
        self._clock = clock
        self._tower = tower
        self._batches = ClaimBatches(self._claim_all)
        self._orphaned = database.repeated(_orphans())

    async def refuse_elsewhere(self, session: AsyncSession, drone_id: DroneId) -> Refused | None:
        """Inside a transaction that changes the drone's lease: a refusal unless this tower is its home. Nobody can
        claim the drone until the transaction ends."""
        row = await session.get(DroneHomeRow, drone_id, with_for_update={"read": True})
        return None if row is not None and row.tower == self._tower else AT_ANOTHER_TOWER

    async def claim(self, drone_id: DroneId, *, only_if_free: bool = False) -> Claimed | None:
        """Makes this tower the home of the drone: its agent has linked here. `only_if_free`: not if another running
        tower is. None: another one is, or the drone was deleted."""
        if not only_if_free:
            return await self._batches.claim(drone_id)
        async with self._database.writing() as session:
            return (await self._claim(session, [drone_id], only_if_free=True)).get(drone_id)

    async def _claim_all(self, drone_ids: list[DroneId]) -> dict[DroneId, Claimed]:
        async with self._database.writing() as session:
            return await self._claim(session, drone_ids, only_if_free=False)

    async def _claim(
        self, session: DatabaseSession, drone_ids: list[DroneId], *, only_if_free: bool
    ) -> dict[DroneId, Claimed]:
        """`drone_ids`: sorted, so that towers lock the rows in the same order."""
        homes = await self._lock_homes(session, drone_ids)
        if only_if_free:
            running = set(await session.scalars(select(TowerMemberRow.tower))) - {self._tower}
            homes = {drone_id: home for drone_id, home in homes.items() if home.tower not in running}
        came = {drone_id for drone_id, home in homes.items() if home.tower != self._tower}
        for drone_id in came:
            homes[drone_id].tower, homes[drone_id].claim = self._tower, homes[drone_id].claim + 1
        # All in this transaction: the sticks of who flies a drone wait until it is at home here.
        settings = await read_settings_of(session, list(homes))
        acknowledged = await read_acknowledged_of(session, list(homes))
        query = select(ControlLeaseRow).where(ControlLeaseRow.drone_id.in_(homes)).order_by(ControlLeaseRow.drone_id)
        leases = {row.drone_id: row for row in await session.scalars(query.with_for_update())}
        for drone_id in came & leases.keys():
            self._end_assistance(session, leases[drone_id])
        named = {one for row in leases.values() for one in (row.holder_id, row.taken_from_id, row.assistant_id)} - {
            None
        }
        people = select(UserRow).where(UserRow.id.in_(named))
        users = {user.id: user for user in await session.scalars(people)} if named else {}
        return {
            drone_id: Claimed(
                home.claim,
                drone_id in came,
                view_of(lease_of_row(leases[drone_id]), users) if drone_id in leases else None,
                drone_id in leases and leases[drone_id].hold_open,
                settings.get(drone_id, DroneSettings()),
                acknowledged.get(drone_id, {}),
            )
            for drone_id, home in homes.items()
        }

    @staticmethod
    async def _lock_homes(session: DatabaseSession, drone_ids: list[DroneId]) -> dict[DroneId, DroneHomeRow]:
        """The rows, locked; new ones where there are none."""
        query = select(DroneHomeRow).where(DroneHomeRow.drone_id.in_(drone_ids)).order_by(DroneHomeRow.drone_id)
        found = {DroneId(row.drone_id): row for row in await session.scalars(query.with_for_update())}
        new = {one: DroneHomeRow(drone_id=one, tower="", claim=0) for one in drone_ids if one not in found}
        session.add_all(new.values())
        return found | new

    def _end_assistance(self, session: AsyncSession, row: ControlLeaseRow) -> None:
        """The former home knew whose turn it was (`after_start.py`)."""
        outcome = decide(lease_of_row(row), Event.ASSIST_END, THE_TOWER)
        if row.assistant_id is None or not isinstance(outcome, Changed):
            return
        reason = "the drone has another tower"
        row.assistant_id, row.epoch = None, outcome.lease.epoch
        row.changed_at, row.reason = self._clock(), reason
        detail = {"reason": reason, "result": "done", "epoch": row.epoch}
        action = f"control.{Event.ASSIST_END.value}"
        record(session, at=self._clock(), actor=TOWER, action=action, drone_id=row.drone_id, detail=detail)

    async def all(self) -> dict[str, list[tuple[int, int]]]:
        """Drones and claims, by tower."""
        homes: dict[str, list[tuple[int, int]]] = {}
        async with self._database.reading() as session:
            for row in await session.execute(select(DroneHomeRow.drone_id, DroneHomeRow.claim, DroneHomeRow.tower)):
                homes.setdefault(row.tower, []).append((row.drone_id, row.claim))
        return homes

    async def orphaned(self) -> list[DroneId]:
        """Drones whose home has ended, and held drones without any."""
        return [DroneId(one) for one in json.loads(await self._database.ask(self._orphaned) or "[]")]


def _orphans() -> Executable:
    """Their ids as JSON, or NULL if there are none: every tower asks each second."""
    left = select(DroneHomeRow.drone_id).where(DroneHomeRow.tower.not_in(select(TowerMemberRow.tower)))
    parts = (ControlLeaseRow.holder_id, ControlLeaseRow.taken_from_id)
    held = select(ControlLeaseRow.drone_id).where(
        or_(*(part.is_not(None) for part in parts)),
        ControlLeaseRow.drone_id.not_in(select(DroneHomeRow.drone_id)),
    )
    both = union_all(left, held).subquery()
    return select(func.json_agg(both.c.drone_id).cast(Text))
