"""The rules of passkeys: added, named, used, removed. Independent of HTTP.

Every function takes a session of `Database.writing()`, so that a change and its audit record are committed together.
Functions that change how many passkeys a user has lock the user's row first.
"""

from __future__ import annotations

import secrets
from datetime import datetime
from typing import Final

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.core.webauthn_values import Assertion, KnownCredential, NewCredential, PasskeyFault
from server.accounts.store.second_factor import LastFactor, forget_codes, new_codes
from server.accounts.store.tables import PasskeyRow, UserRow
from server.accounts.store.users import UnknownUser
from server.audit.store.action import AuditAction
from server.kernel.names import clean_name
from server.kernel.refusal import Refusal

MAX_PER_USER: Final = 20
HANDLE_BYTES: Final = 32


class UnknownPasskey(Refusal):
    """The passkey does not exist, or belongs to another user. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("there is no such passkey")


class TooManyPasskeys(Refusal):
    def __init__(self) -> None:
        super().__init__(f"a user has at most {MAX_PER_USER} passkeys: remove one first")


class PasskeyKnown(Refusal):
    def __init__(self) -> None:
        super().__init__("this passkey is there already")


async def list_passkeys(session: AsyncSession, user_id: int) -> list[PasskeyRow]:
    """Sorted from oldest to newest."""
    return list(await session.scalars(select(PasskeyRow).where(PasskeyRow.user_id == user_id).order_by(PasskeyRow.id)))


async def begin_adding(session: AsyncSession, user_id: int) -> tuple[UserRow, list[KnownCredential]]:
    """Returns the user, who now has a handle, and their existing passkeys. Raises TooManyPasskeys."""
    row = await _locked(session, user_id)
    there = await list_passkeys(session, row.id)
    if len(there) >= MAX_PER_USER:
        raise TooManyPasskeys
    if row.passkey_handle is None:
        row.passkey_handle = secrets.token_bytes(HANDLE_BYTES)
    return row, [known(one) for one in there]


async def add(
    session: AsyncSession, *, user_id: int, new: NewCredential, name: str, party_id: str, action: AuditAction
) -> tuple[PasskeyRow, list[str]]:
    """Returns the passkey, and recovery codes if it is the first factor: they are shown only once.

    Raises BadName, PasskeyKnown or TooManyPasskeys.
    """
    name = clean_name(name)
    row = await _locked(session, user_id)
    if row.passkey_count >= MAX_PER_USER:
        raise TooManyPasskeys
    if await session.scalar(select(PasskeyRow.id).where(PasskeyRow.credential_id == new.id)) is not None:
        raise PasskeyKnown
    codes = [] if row.has_second_factor else await new_codes(session, row)
    passkey = PasskeyRow(
        user_id=row.id,
        credential_id=new.id,
        public_key=new.public_key,
        sign_count=new.sign_count,
        name=name,
        party_id=party_id,
        transports=" ".join(new.transports),
        synced=new.synced,
        created_at=action.at,
    )
    session.add(passkey)
    row.passkey_count += 1
    await session.flush()
    action.record(session, "passkey.added", user_id=row.id, user=row.name, passkey_id=passkey.id, passkey=name)
    return passkey, codes


async def rename(session: AsyncSession, *, user_id: int, passkey_id: int, name: str, action: AuditAction) -> PasskeyRow:
    """Raises UnknownPasskey or BadName."""
    name = clean_name(name)
    passkey = await _own(session, user_id, passkey_id)
    if name != passkey.name:
        action.record(session, "passkey.renamed", passkey_id=passkey.id, passkey=name, before=passkey.name)
        passkey.name = name
    return passkey


async def remove(
    session: AsyncSession, *, user_id: int, passkey_id: int, action: AuditAction, is_demanded: bool
) -> None:
    """`is_demanded`: the user must have a second factor. Raises UnknownPasskey or LastFactor."""
    row = await _locked(session, user_id)
    passkey = await _own(session, user_id, passkey_id)
    is_last = row.passkey_count == 1 and row.totp_sealed is None
    if is_last and is_demanded:
        raise LastFactor
    action.record(
        session, "passkey.removed", user_id=row.id, user=row.name, passkey_id=passkey.id, passkey=passkey.name
    )
    await session.delete(passkey)
    row.passkey_count -= 1
    if is_last:
        await forget_codes(session, row.id)


async def find(session: AsyncSession, credential_id: bytes) -> tuple[PasskeyRow, UserRow] | None:
    """Returns the passkey and its user."""
    query = select(PasskeyRow, UserRow).join(UserRow, UserRow.id == PasskeyRow.user_id)
    found = (await session.execute(query.where(PasskeyRow.credential_id == credential_id))).one_or_none()
    return (found[0], found[1]) if found is not None else None


async def use(session: AsyncSession, passkey_id: int, assertion: Assertion, at: datetime) -> PasskeyRow:
    """Records a use with a valid signature. Raises PasskeyFault if the passkey is gone, or if its counter did not
    increase, which means that two authenticators have the same key."""
    passkey = await session.scalar(select(PasskeyRow).where(PasskeyRow.id == passkey_id).with_for_update())
    if passkey is None:
        raise PasskeyFault("removed meanwhile")
    counts = assertion.sign_count > 0 or passkey.sign_count > 0
    if counts and assertion.sign_count <= passkey.sign_count:
        raise PasskeyFault(COUNTER_WENT_BACK)
    passkey.sign_count = assertion.sign_count
    passkey.synced = assertion.synced
    passkey.last_used_at = at
    return passkey


COUNTER_WENT_BACK: Final = "its counter went back: there may be a copy of it"


def known(row: PasskeyRow) -> KnownCredential:
    return KnownCredential(row.credential_id, tuple(row.transports.split()))


async def _locked(session: AsyncSession, user_id: int) -> UserRow:
    row = await session.scalar(
        select(UserRow).where(UserRow.id == user_id).with_for_update().execution_options(populate_existing=True)
    )
    if row is None:
        raise UnknownUser
    return row


async def _own(session: AsyncSession, user_id: int, passkey_id: int) -> PasskeyRow:
    row = await session.get(PasskeyRow, passkey_id)
    if row is None or row.user_id != user_id:
        raise UnknownPasskey
    return row
