"""The rules of the fleet: create, rename, delete drones, their credentials and their owners. Knows nothing of HTTP.

Every function takes a session of `Database.writing()`, so that a rule and its audit record live or die together.
"""

from __future__ import annotations

import secrets
from collections.abc import Collection
from typing import Final

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.access import UnknownDrone
from server.accounts.users import get_user
from server.audit.deed import Deed
from server.audit.tables import AuditEventRow
from server.fleet.snapshot import begin_fleet_change
from server.fleet.tables import DroneRow, OwnershipRow
from server.names import clean_name, is_name, name_key
from server.refusal import Refusal
from wire.credential import Credential
from wire.ids import DroneId

DELETED: Final = "drone.deleted"
"""In the audit trail."""


class DroneNameTaken(Refusal):
    def __init__(self) -> None:
        super().__init__("another drone has this name")


async def find_drone(session: AsyncSession, name: str) -> DroneRow | None:
    if not is_name(name):
        return None
    return await session.scalar(select(DroneRow).where(DroneRow.name_key == name_key(clean_name(name))))


async def get_drone(session: AsyncSession, drone_id: int) -> DroneRow:
    row = await session.get(DroneRow, drone_id)
    if row is None:
        raise UnknownDrone
    return row


async def list_drones(session: AsyncSession) -> list[DroneRow]:
    return list(await session.scalars(select(DroneRow).order_by(DroneRow.id)))


async def create_drone(session: AsyncSession, *, name: str, deed: Deed) -> tuple[DroneRow, Credential]:
    """The credential is told here and never again: the database keeps its hash only."""
    name = clean_name(name)
    await begin_fleet_change(session)
    if await find_drone(session, name) is not None:
        raise DroneNameTaken
    row = DroneRow(name=name, name_key=name_key(name), credential_hash="", created_at=deed.at)
    session.add(row)
    await session.flush()  # the id is a part of the credential
    credential = _new_credential(row)
    deed.record(session, "drone.created", drone_id=row.id, drone=name)
    return row, credential


async def rename_drone(session: AsyncSession, *, drone_id: int, name: str, deed: Deed) -> DroneRow:
    name = clean_name(name)
    await begin_fleet_change(session)
    row = await get_drone(session, drone_id)
    namesake = await find_drone(session, name)
    if namesake is not None and namesake.id != row.id:
        raise DroneNameTaken
    if name != row.name:
        deed.record(session, "drone.renamed", drone_id=row.id, drone=name, before=row.name)
        row.name, row.name_key = name, name_key(name)
    return row


async def deleted_among(session: AsyncSession, drone_ids: Collection[int]) -> frozenset[int]:
    """Which of these were deleted on purpose, as the trail says: any other that is not there is missing for another
    reason, as an older copy of the database."""
    query = select(AuditEventRow.drone_id).where(AuditEventRow.action == DELETED, AuditEventRow.drone_id.in_(drone_ids))
    return frozenset(one for one in await session.scalars(query) if one is not None)


async def delete_drone(session: AsyncSession, *, drone_id: int, deed: Deed) -> None:
    await begin_fleet_change(session)
    row = await get_drone(session, drone_id)
    deed.record(session, DELETED, drone_id=row.id, drone=row.name)
    await session.delete(row)


async def rotate_credential(session: AsyncSession, *, drone_id: int, deed: Deed) -> tuple[DroneRow, Credential]:
    """The old credential is worth nothing from the commit on."""
    await begin_fleet_change(session)
    row = await get_drone(session, drone_id)
    credential = _new_credential(row)
    deed.record(session, "drone.credential_rotated", drone_id=row.id, drone=row.name)
    return row, credential


async def add_owner(session: AsyncSession, *, drone_id: int, user_id: int, deed: Deed) -> None:
    """Adding an owner twice changes nothing."""
    await begin_fleet_change(session)
    drone, user = await get_drone(session, drone_id), await get_user(session, user_id)
    if await session.get(OwnershipRow, (drone.id, user.id)) is not None:
        return
    session.add(OwnershipRow(drone_id=drone.id, user_id=user.id))
    deed.record(
        session,
        "drone.owner_added",
        drone_id=drone.id,
        drone=drone.name,
        user_id=user.id,
        user=user.name,
    )


async def remove_owner(session: AsyncSession, *, drone_id: int, user_id: int, deed: Deed) -> None:
    """Removing somebody who owns nothing changes nothing."""
    await begin_fleet_change(session)
    drone, user = await get_drone(session, drone_id), await get_user(session, user_id)
    ownership = await session.get(OwnershipRow, (drone.id, user.id))
    if ownership is None:
        return
    await session.delete(ownership)
    deed.record(
        session,
        "drone.owner_removed",
        drone_id=drone.id,
        drone=drone.name,
        user_id=user.id,
        user=user.name,
    )


def _new_credential(row: DroneRow) -> Credential:
    credential = Credential(drone_id=DroneId(row.id), secret=secrets.token_urlsafe(32))
    row.credential_hash = credential.hashed()
    return credential
