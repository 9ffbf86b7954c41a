"""The rules of enrolment: a token with which an agent registers its key for a drone, once. Independent of HTTP.

Every function that changes data takes a session of `Database.writing()`, so that a token is valid for one use.
"""

from __future__ import annotations

import base64
import secrets
from collections.abc import Mapping
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final

from sqlalchemy import func, select, update
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.sessions import hash_token
from server.audit.store.action import AuditAction
from server.audit.store.trail import Actor
from server.fleet.store.drones import get_drone, set_key
from server.fleet.store.tables import DroneRow, EnrolmentRow
from server.kernel.refusal import Refusal
from wire.drone_key import MalformedKey, enrolment_statement, is_signed, key_bytes, key_text
from wire.ids import DroneId

PREFIX: Final = "twe_"
MAX_LISTED: Final = 200
MAX_CONCURRENT: Final = 500
"""Drones per query: SQLite accepts that many values, and the write lock is not held for long."""
COMPANION: Final = Actor(None, "enrolling agent")


class UnknownEnrolment(Refusal):
    def __init__(self) -> None:
        super().__init__("there is no such enrolment")


class BadEnrolment(Refusal):
    """Unknown, used, expired or cancelled. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("this enrolment token is not valid, or no longer valid: ask an admin for a new one")


class BadDroneKey(Refusal):
    def __init__(self) -> None:
        super().__init__("the public key or its signature is not valid")


class EnrolmentState(StrEnum):
    WAITING = "waiting"
    USED = "used"
    """A key was registered for the drone."""
    SEEN = "seen"
    """The agent has also linked with it."""
    EXPIRED = "expired"
    CANCELLED = "cancelled"


def state_of(row: EnrolmentRow, now: datetime) -> EnrolmentState:
    if row.used_at is not None:
        return EnrolmentState.SEEN if row.agent_seen_at is not None else EnrolmentState.USED
    if row.cancelled:
        return EnrolmentState.CANCELLED
    return EnrolmentState.EXPIRED if now >= row.expires_at else EnrolmentState.WAITING


async def begin(
    session: AsyncSession, *, drone_id: int, lasts_s: float, action: AuditAction
) -> tuple[EnrolmentRow, DroneRow, str, list[int]]:
    """Returns the token, which is shown only here. Cancels pending enrolments of the same drone and returns their
    ids."""
    drone = await get_drone(session, drone_id)
    waiting = (
        await session.scalars(
            update(EnrolmentRow)
            .where(EnrolmentRow.drone_id == drone_id, EnrolmentRow.used_at.is_(None), EnrolmentRow.cancelled.is_(False))
            .values(cancelled=True)
            .returning(EnrolmentRow.id)
        )
    ).all()
    token = PREFIX + secrets.token_urlsafe(32)
    row = EnrolmentRow(
        drone_id=drone_id,
        token_hash=hash_token(token),
        created_by=action.by.name[:64],
        created_at=action.at,
        expires_at=action.at + timedelta(seconds=lasts_s),
        cancelled=False,
        used_from="",
    )
    session.add(row)
    await session.flush()
    action.record(session, "enrolment.began", drone_id=drone_id, drone=drone.name, enrolment_id=row.id)
    return row, drone, token, list(waiting)


async def cancel(session: AsyncSession, *, enrolment_id: int, action: AuditAction) -> EnrolmentRow:
    """An enrolment that was used or has expired does not change."""
    row = await session.get(EnrolmentRow, enrolment_id)
    if row is None:
        raise UnknownEnrolment
    if row.used_at is None and not row.cancelled:
        row.cancelled = True
        action.record(session, "enrolment.cancelled", drone_id=row.drone_id, enrolment_id=row.id)
    return row


def read_key(*, token: str, public_key: str, signature: str) -> bytes:
    """Returns the key, which must have signed this token. 43 and 86 characters of base64url. Raises BadDroneKey."""
    try:
        key = key_bytes(public_key)
        signed = base64.b64decode(f"{signature}==", altchars=b"-_", validate=True)
    except (MalformedKey, ValueError):
        raise BadDroneKey from None
    if not is_signed(key, signed, enrolment_statement(token, key)):
        raise BadDroneKey
    return key


async def use(session: AsyncSession, *, token: str, public_key: bytes, at: datetime, address: str) -> EnrolmentRow:
    """Registers the key for the drone; its agent's previous key or credential becomes invalid. Raises BadEnrolment.

    An agent that did not receive the response retries: the same key gets the same response while it is the drone's.
    """
    key = key_text(public_key)
    found: EnrolmentRow | None = await session.scalar(
        update(EnrolmentRow)
        .where(
            EnrolmentRow.token_hash == hash_token(token),
            EnrolmentRow.used_at.is_(None),
            EnrolmentRow.cancelled.is_(False),
            EnrolmentRow.expires_at > at,
        )
        .values(used_at=at, used_from=address[:64], public_key=key)
        .returning(EnrolmentRow)
    )
    if found is None:
        return await _used_before(session, token, key)
    action = AuditAction(by=COMPANION, at=at, address=address)
    drone = await set_key(session, drone_id=found.drone_id, public_key=public_key, action=action)
    action.record(session, "enrolment.used", drone_id=drone.id, drone=drone.name, enrolment_id=found.id)
    return found


async def _used_before(session: AsyncSession, token: str, key: str) -> EnrolmentRow:
    row: EnrolmentRow | None = await session.scalar(
        select(EnrolmentRow)
        .join(DroneRow, DroneRow.id == EnrolmentRow.drone_id)
        .where(
            EnrolmentRow.token_hash == hash_token(token),
            EnrolmentRow.public_key == key,
            DroneRow.public_key == key,
        )
    )
    if row is None:
        raise BadEnrolment
    return row


async def just_seen(session: AsyncSession, linked_at: Mapping[DroneId, datetime]) -> list[EnrolmentRow]:
    """For drones whose agents have just linked: returns the newest used enrolment of each, if the agent links for the
    first time since. Skips an enrolment used after the agent linked, because the agent has not linked with it.

    At most MAX_CONCURRENT drones. A session of `Database.reading()` is enough.
    """
    newest = (
        select(func.max(EnrolmentRow.id))
        .where(EnrolmentRow.drone_id.in_(linked_at), EnrolmentRow.used_at.is_not(None))
        .group_by(EnrolmentRow.drone_id)
    )
    rows = await session.scalars(
        select(EnrolmentRow).where(EnrolmentRow.id.in_(newest), EnrolmentRow.agent_seen_at.is_(None))
    )
    return [row for row in rows if row.used_at is not None and row.used_at <= linked_at[DroneId(row.drone_id)]]


async def agents_seen(session: AsyncSession, linked_at: Mapping[DroneId, datetime]) -> list[EnrolmentRow]:
    """Marks the enrolments of `just_seen` as seen."""
    rows = await just_seen(session, linked_at)
    for row in rows:
        row.agent_seen_at = linked_at[DroneId(row.drone_id)]
    return rows


async def list_enrolments(session: AsyncSession) -> list[tuple[EnrolmentRow, DroneRow]]:
    """Newest first, at most MAX_LISTED, with their drones."""
    query = (
        select(EnrolmentRow, DroneRow)
        .join(DroneRow, DroneRow.id == EnrolmentRow.drone_id)
        .order_by(EnrolmentRow.id.desc())
        .limit(MAX_LISTED)
    )
    return [(row, drone) for row, drone in await session.execute(query)]


async def get_enrolment(session: AsyncSession, enrolment_id: int) -> tuple[EnrolmentRow, DroneRow] | None:
    """Returns the enrolment with its drone."""
    query = select(EnrolmentRow, DroneRow).join(DroneRow, DroneRow.id == EnrolmentRow.drone_id)
    found = (await session.execute(query.where(EnrolmentRow.id == enrolment_id))).one_or_none()
    return None if found is None else (found[0], found[1])
