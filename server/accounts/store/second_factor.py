"""The rules of the second factor: begin, confirm, check at sign-in, renew, remove. Independent of HTTP.

There are two kinds: codes of an authenticator app, here, and passkeys (`passkeys.py`). Recovery codes serve both: they
come with the first factor of an account and go with its last.

Every function takes a session of `Database.writing()`, so that a code can be used only once.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import delete, func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.core import totp
from server.accounts.store.sealed_factors import about
from server.accounts.store.tables import PasskeyRow, RecoveryCodeRow, UserRow
from server.audit.store.action import AuditAction
from server.kernel.refusal import Refusal
from server.runtime.vault import Vault


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
    """Wrong, or used before. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("the code is wrong or was already used: wait for the next one")


def factors_of(row: UserRow) -> list[str]:
    """Returns the kinds of second factor that the account has, the best first: `passkey`, `code`."""
    return ["passkey"] * (row.passkey_count > 0) + ["code"] * (row.totp_sealed is not None)


async def codes_left(session: AsyncSession, user_id: int) -> int:
    """Returns the number of unused recovery codes."""
    query = select(func.count()).select_from(RecoveryCodeRow).where(RecoveryCodeRow.user_id == user_id)
    return await session.scalar(query) or 0


def begin(row: UserRow, vault: Vault) -> str:
    """Returns a secret to be shown. Nothing changes until the user proves to have it."""
    if row.totp_sealed is not None:
        raise SecondFactorOn
    secret = totp.new_secret()
    row.totp_pending_sealed = vault.seal(secret, about=about(row.id))
    return secret


async def confirm(session: AsyncSession, row: UserRow, code: str, action: AuditAction, vault: Vault) -> list[str]:
    """Confirms the secret: sign-in asks for codes from now on. Returns the recovery codes, shown only once; none if a
    passkey has already brought them."""
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
    """Returns whether the code is valid; a valid code is used up with the commit. Does not tell whether it was a
    recovery code: ask `codes_left`."""
    if totp.looks_like_totp(code):
        if row.totp_sealed is None:
            return False
        # The row is read again and locked: if two use one code at the same time, one is refused.
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
    """Creates new recovery codes and invalidates the old ones. Raises NoSecondFactorBegun."""
    if not row.has_second_factor:
        raise NoSecondFactorBegun
    action.record(session, "user.recovery_codes_renewed", user_id=row.id, user=row.name)
    return await new_codes(session, row)


async def remove(session: AsyncSession, row: UserRow, action: AuditAction, *, is_demanded: bool = False) -> None:
    """Removal by the user; their passkeys stay. `is_demanded`: one factor must stay. Raises NoSecondFactorBegun or
    LastFactor."""
    await _lock(session, row)
    if row.totp_sealed is None:
        raise NoSecondFactorBegun
    if is_demanded and not row.passkey_count:
        raise LastFactor
    await _remove_codes_of_authenticator(session, row, action)
    if not row.has_second_factor:
        await forget_codes(session, row.id)


async def reset(session: AsyncSession, row: UserRow, action: AuditAction) -> None:
    """Removes every factor, passkeys too. Harmless if there is none. An admin who does this for another user also ends
    their sessions and tokens."""
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
    """Deletes the recovery codes, together with the last factor of an account."""
    await session.execute(delete(RecoveryCodeRow).where(RecoveryCodeRow.user_id == user_id))


async def new_codes(session: AsyncSession, row: UserRow) -> list[str]:
    """Creates recovery codes, shown only once, and invalidates the previous ones."""
    await forget_codes(session, row.id)
    codes = totp.new_recovery_codes()
    session.add_all(RecoveryCodeRow(user_id=row.id, code_hash=totp.hash_recovery_code(code)) for code in codes)
    return codes


async def _lock(session: AsyncSession, row: UserRow) -> None:
    """Reads the row again: if two change factors at the same time, the second sees the change of the first."""
    await session.refresh(row, with_for_update=True)


async def _remove_codes_of_authenticator(session: AsyncSession, row: UserRow, action: AuditAction) -> None:
    had_one = row.totp_sealed is not None
    row.totp_sealed = row.totp_pending_sealed = row.totp_last_step = None
    if had_one:
        action.record(session, "user.second_factor_off", user_id=row.id, user=row.name)
