"""The rules of measures against a drone that sends too much: who takes and lifts them.

Every rule takes a session of `Database.writing()`, so that a change and its audit record are committed together.
"""

from __future__ import annotations

from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.action import AuditAction
from server.fleet.store.drones import get_drone
from server.fleet.store.snapshot import begin_fleet_change, ties_of
from server.fleet.store.tables import RestraintRow
from server.kernel.access import AdminsOnly, UnknownDrone
from server.kernel.people import Principal
from server.kernel.relations import Relation, Right, may, relation_of
from server.kernel.restraint import Measure


async def restrain(
    session: AsyncSession, *, drone_id: int, measure: Measure, reason: str, by: Principal, action: AuditAction
) -> None:
    """Takes this measure in place of the last one. Raises UnknownDrone, AdminsOnly."""
    await begin_fleet_change(session)
    drone = await get_drone(session, drone_id)
    row, by_admin = await _may(session, drone_id=drone_id, by=by, action=action)
    before = row.measure if row is not None else ""
    if row is None:
        row = RestraintRow(drone_id=drone_id)
        session.add(row)
    row.measure, row.reason = measure.value, reason
    row.by_name, row.by_admin, row.since = by.name, by_admin, action.at
    action.record(
        session,
        "drone.restrained",
        drone_id=drone_id,
        drone=drone.name,
        measure=measure.value,
        before=before,
        reason=reason,
    )


async def lift_restraint(session: AsyncSession, *, drone_id: int, by: Principal, action: AuditAction) -> None:
    """Repeating it changes nothing. Raises UnknownDrone, AdminsOnly."""
    await begin_fleet_change(session)
    drone = await get_drone(session, drone_id)
    row, _ = await _may(session, drone_id=drone_id, by=by, action=action)
    if row is not None:
        await session.delete(row)
        action.record(session, "drone.restraint_lifted", drone_id=drone_id, drone=drone.name, measure=row.measure)


async def _may(
    session: AsyncSession, *, drone_id: int, by: Principal, action: AuditAction
) -> tuple[RestraintRow | None, bool]:
    """Returns the present measure, and whether this user is an admin of the tower. An admin of the team does not change
    what an admin of the tower has done."""
    relation = relation_of(await ties_of(session, drone_id, action.at), by.user_id, by.role)
    if relation is Relation.STRANGER:
        raise UnknownDrone
    row = await session.get(RestraintRow, drone_id)
    is_admin = relation is Relation.ADMIN
    if not may(relation, Right.RESTRAIN) or (row is not None and row.by_admin and not is_admin):
        raise AdminsOnly
    return row, is_admin
