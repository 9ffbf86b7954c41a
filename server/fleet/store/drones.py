"""The rules of the fleet: create, rename, delete drones, their keys and their owners. Independent of HTTP.

Every function takes a session of `Database.writing()`, so that a change and its audit record are committed together.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.users import get_user
from server.audit.store.action import AuditAction
from server.audit.store.tables import AuditEventRow
from server.fleet.store.snapshot import begin_fleet_change
from server.fleet.store.tables import DroneRow, OwnershipRow
from server.kernel.access import UnknownDrone
from server.kernel.names import clean_name, is_name, name_key
from server.kernel.refusal import Refusal
from wire.drone_key import fingerprint, key_text

DELETED: Final = "drone.deleted"
"""The action in the audit trail."""


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


async def create_drone(session: AsyncSession, *, name: str, action: AuditAction) -> DroneRow:
    """No agent can sign in for this drone before one is enrolled (server.fleet.store.enrolments)."""
    name = clean_name(name)
    await begin_fleet_change(session)
    if await find_drone(session, name) is not None:
        raise DroneNameTaken
    row = DroneRow(name=name, name_key=name_key(name), credential_hash="", created_at=action.at)
    session.add(row)
    await session.flush()
    action.record(session, "drone.created", drone_id=row.id, drone=name)
    return row


async def rename_drone(session: AsyncSession, *, drone_id: int, name: str, action: AuditAction) -> DroneRow:
    name = clean_name(name)
    await begin_fleet_change(session)
    row = await get_drone(session, drone_id)
    namesake = await find_drone(session, name)
    if namesake is not None and namesake.id != row.id:
        raise DroneNameTaken
    if name != row.name:
        action.record(session, "drone.renamed", drone_id=row.id, drone=name, before=row.name)
        row.name, row.name_key = name, name_key(name)
    return row


async def deleted_among(session: AsyncSession, drone_ids: Collection[int]) -> frozenset[int]:
    """Returns those that were deleted on purpose according to the trail: other missing drones have another reason, such
    as an older copy of the database."""
    query = select(AuditEventRow.drone_id).where(AuditEventRow.action == DELETED, AuditEventRow.drone_id.in_(drone_ids))
    return frozenset(one for one in await session.scalars(query) if one is not None)


async def delete_drone(session: AsyncSession, *, drone_id: int, action: AuditAction) -> None:
    await begin_fleet_change(session)
    row = await get_drone(session, drone_id)
    action.record(session, DELETED, drone_id=row.id, drone=row.name)
    await session.delete(row)


async def set_key(session: AsyncSession, *, drone_id: int, public_key: bytes, action: AuditAction) -> DroneRow:
    """Sets the drone's key. Its previous key or credential becomes invalid with the commit."""
    await begin_fleet_change(session)
    row = await get_drone(session, drone_id)
    _put_key(row, public_key, action)
    key_fingerprint = fingerprint(public_key)
    action.record(session, "drone.key_set", drone_id=row.id, drone=row.name, fingerprint=key_fingerprint)
    return row


async def revoke_key(session: AsyncSession, *, drone_id: int, action: AuditAction) -> DroneRow:
    """Invalidates the drone's key and credential with the commit. Repeating it changes nothing."""
    await begin_fleet_change(session)
    row = await get_drone(session, drone_id)
    if row.public_key is not None or row.credential_hash:
        row.public_key, row.key_since, row.credential_hash = None, None, ""
        action.record(session, "drone.key_revoked", drone_id=row.id, drone=row.name)
    return row


async def exchange_credential(
    session: AsyncSession, *, drone_id: int, credential_hash: str, public_key: bytes, action: AuditAction
) -> bool:
    """Replaces the bearer credential by the key and deletes it. False if it is not (or no longer) the drone's: if two
    agents present the same one, the first becomes the drone."""
    await begin_fleet_change(session)
    row = await session.get(DroneRow, drone_id)
    if row is None or not credential_hash or row.credential_hash != credential_hash:
        return False
    _put_key(row, public_key, action)
    key_fingerprint = fingerprint(public_key)
    action.record(session, "drone.credential_exchanged", drone_id=row.id, drone=row.name, fingerprint=key_fingerprint)
    return True


def _put_key(row: DroneRow, public_key: bytes, action: AuditAction) -> None:
    row.public_key, row.key_since, row.credential_hash = key_text(public_key), action.at, ""


async def add_owner(session: AsyncSession, *, drone_id: int, user_id: int, action: AuditAction) -> None:
    """Adding an owner twice changes nothing."""
    await begin_fleet_change(session)
    drone, user = await get_drone(session, drone_id), await get_user(session, user_id)
    if await session.get(OwnershipRow, (drone.id, user.id)) is not None:
        return
    session.add(OwnershipRow(drone_id=drone.id, user_id=user.id))
    action.record(
        session,
        "drone.owner_added",
        drone_id=drone.id,
        drone=drone.name,
        user_id=user.id,
        user=user.name,
    )


async def remove_owner(session: AsyncSession, *, drone_id: int, user_id: int, action: AuditAction) -> None:
    """Removing a user who is not an owner changes nothing."""
    await begin_fleet_change(session)
    drone, user = await get_drone(session, drone_id), await get_user(session, user_id)
    ownership = await session.get(OwnershipRow, (drone.id, user.id))
    if ownership is None:
        return
    await session.delete(ownership)
    action.record(
        session,
        "drone.owner_removed",
        drone_id=drone.id,
        drone=drone.name,
        user_id=user.id,
        user=user.name,
    )
