"""The rules of the second factor: begin, confirm, check at sign-in, renew, remove. Knows nothing of HTTP.

There are two kinds: authenticator codes, here, and passkeys (`passkeys.py`). Recovery codes serve both: they come with
an account's first factor and go with its last. Every function takes a session of `Database.writing()`, so that a used
code is used everywhere.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import delete, func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.domain.refusal import Refusal
from server.live.accounts import totp
from server.runtime.vault import Vault
from server.store.accounts.sealed_factors import about
from server.store.accounts.tables import PasskeyRow, RecoveryCodeRow, UserRow
from server.store.audit.action import AuditAction


class SecondFactorOn(Refusal):
    def __init__(self) -> None:
        super().__init__("there is a second factor already: remove it first")


class NoSecondFactorBegun(Refusal):
    def __init__(self) -> None:
        super().__init__("there is no second factor to confirm or change: set one up first")


class LastFactor(Refusal):
    def __init__(self) -> None:
        super().__init__("you must have a second factor, and this is your only one: add another one first")


class WrongCode(Refusal):
    """Wrong, or used before. The message does not say which, on purpose."""

    def __init__(self) -> None:
        super().__init__("the code is wrong or was already used: wait for the next one")


def factors_of(row: UserRow) -> list[str]:
    """The user's kinds of second factor, best first: `passkey`, `code`."""
    return ["passkey"] * (row.passkey_count > 0) + ["code"] * (row.totp_sealed is not None)


async def codes_left(session: AsyncSession, user_id: int) -> int:
    """How many recovery codes have not been used."""
    query = select(func.count()).select_from(RecoveryCodeRow).where(RecoveryCodeRow.user_id == user_id)
    return await session.scalar(query) or 0


def begin(row: UserRow, vault: Vault) -> str:
    """A secret to be shown. Nothing changes until its user proves to have it."""
    if row.totp_sealed is not None:
        raise SecondFactorOn
    secret = totp.new_secret()
    row.totp_pending_sealed = vault.seal(secret, about=about(row.id))
    return secret


async def confirm(session: AsyncSession, row: UserRow, code: str, action: AuditAction, vault: Vault) -> list[str]:
    """Enables the authenticator: sign-ins require its code. Returns the recovery codes, shown only this once; none if a
    passkey brought them already."""
    await _lock(session, row)
    if row.totp_sealed is not None:
        raise SecondFactorOn
    if row.totp_pending_sealed is None:
        raise NoSecondFactorBegun
    secret = vault.open(row.totp_pending_sealed, about=about(row.id))
    step = totp.step_of(code, secret, now=action.at, after=None)
    if step is None:
        raise WrongCode
    row.totp_sealed, row.totp_pending_sealed, row.totp_last_step = row.totp_pending_sealed, None, step
    action.record(session, "user.second_factor_on", user_id=row.id, user=row.name)
    return [] if row.passkey_count else await new_codes(session, row)


async def spend(session: AsyncSession, row: UserRow, code: str, now: datetime, vault: Vault) -> bool:
    """Whether the code is valid; a valid code is used up by the commit.

    Does not say whether it was a recovery code: compare `codes_left`.
    """
    if totp.looks_like_totp(code):
        if row.totp_sealed is None:
            return False
        # The row is read again and locked: of two who use one code at the same moment one is refused.
        last = await session.scalar(select(UserRow.totp_last_step).where(UserRow.id == row.id).with_for_update())
        step = totp.step_of(code, vault.open(row.totp_sealed, about=about(row.id)), now=now, after=last)
        if step is None:
            return False
        row.totp_last_step = step
        return True
    used = await session.execute(
        delete(RecoveryCodeRow)
        .where(RecoveryCodeRow.user_id == row.id, RecoveryCodeRow.code_hash == totp.hash_recovery_code(code))
        .returning(RecoveryCodeRow.id)
    )
    return used.first() is not None


async def renew_codes(session: AsyncSession, row: UserRow, action: AuditAction) -> list[str]:
    """New recovery codes; the old ones are worth nothing. Raises NoSecondFactorBegun."""
    if not row.has_second_factor:
        raise NoSecondFactorBegun
    action.record(session, "user.recovery_codes_renewed", user_id=row.id, user=row.name)
    return await new_codes(session, row)


async def remove(session: AsyncSession, row: UserRow, action: AuditAction, *, is_demanded: bool = False) -> None:
    """By its user; their passkeys stay. `is_demanded`: one factor must. Raises NoSecondFactorBegun or LastFactor."""
    await _lock(session, row)
    if row.totp_sealed is None:
        raise NoSecondFactorBegun
    if is_demanded and not row.passkey_count:
        raise LastFactor
    await _remove_codes_of_authenticator(session, row, action)
    if not row.has_second_factor:
        await forget_codes(session, row.id)


async def reset(session: AsyncSession, row: UserRow, action: AuditAction) -> None:
    """Removes every factor, passkeys too. Idempotent. An admin who does this for a user also ends their sessions and
    tokens."""
    await _lock(session, row)
    await _remove_codes_of_authenticator(session, row, action)
    for passkey in await session.scalars(select(PasskeyRow).where(PasskeyRow.user_id == row.id)):
        await session.delete(passkey)
        action.record(
            session, "passkey.removed", user_id=row.id, user=row.name, passkey_id=passkey.id, passkey=passkey.name
        )
    row.passkey_count = 0
    await forget_codes(session, row.id)


async def forget_codes(session: AsyncSession, user_id: int) -> None:
    """The recovery codes: with the last factor of an account."""
    await session.execute(delete(RecoveryCodeRow).where(RecoveryCodeRow.user_id == user_id))


async def new_codes(session: AsyncSession, row: UserRow) -> list[str]:
    """New recovery codes, shown only this once. The former ones become invalid."""
    await forget_codes(session, row.id)
    codes = totp.new_recovery_codes()
    session.add_all(RecoveryCodeRow(user_id=row.id, code_hash=totp.hash_recovery_code(code)) for code in codes)
    return codes


async def _lock(session: AsyncSession, row: UserRow) -> None:
    """Reads the row again: of two who change factors at the same moment the second sees what the first has done."""
    await session.refresh(row, with_for_update=True)


async def _remove_codes_of_authenticator(session: AsyncSession, row: UserRow, action: AuditAction) -> None:
    had_one = row.totp_sealed is not None
    row.totp_sealed = row.totp_pending_sealed = row.totp_last_step = None
    if had_one:
        action.record(session, "user.second_factor_off", user_id=row.id, user=row.name)
