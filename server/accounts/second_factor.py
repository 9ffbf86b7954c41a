"""The rules of the second factor: begin, confirm, check at the door, renew, remove. Knows nothing of HTTP.

Every function takes a session of `Database.writing()`, so that a code that was used is used for everybody.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import delete, func, select
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts import totp
from server.accounts.sealed_factors import about
from server.accounts.tables import RecoveryCodeRow, UserRow
from server.audit.deed import Deed
from server.refusal import Refusal
from server.vault import Vault


class SecondFactorOn(Refusal):
    def __init__(self) -> None:
        super().__init__("there is a second factor already: remove it first")


class NoSecondFactorBegun(Refusal):
    def __init__(self) -> None:
        super().__init__("there is no second factor to confirm or to change: begin with one")


class WrongCode(Refusal):
    """Wrong, or used before: on purpose not said which."""

    def __init__(self) -> None:
        super().__init__("the code is wrong, or was used already: wait for the next one")


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


async def confirm(session: AsyncSession, row: UserRow, code: str, deed: Deed, vault: Vault) -> list[str]:
    """From here on the door asks for codes. Returns the recovery codes, which are told this once."""
    if row.totp_sealed is not None:
        raise SecondFactorOn
    if row.totp_pending_sealed is None:
        raise NoSecondFactorBegun
    secret = vault.open(row.totp_pending_sealed, about=about(row.id))
    step = totp.step_of(code, secret, now=deed.at, after=None)
    if step is None:
        raise WrongCode
    row.totp_sealed, row.totp_pending_sealed, row.totp_last_step = row.totp_pending_sealed, None, step
    deed.record(session, "user.second_factor_on", user_id=row.id, user=row.name)
    return await _new_codes(session, row)


async def spend(session: AsyncSession, row: UserRow, code: str, now: datetime, vault: Vault) -> bool:
    """Whether the code is good; if it is, it is worth nothing from the commit on. True for "by a recovery code"
    is not told: ask `codes_left`."""
    if row.totp_sealed is None:
        return False
    if totp.looks_like_totp(code):
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


async def renew_codes(session: AsyncSession, row: UserRow, code: str, deed: Deed, vault: Vault) -> list[str]:
    """New recovery codes; the old ones are worth nothing. Raises WrongCode."""
    await _prove(session, row, code, deed, vault)
    deed.record(session, "user.recovery_codes_renewed", user_id=row.id, user=row.name)
    return await _new_codes(session, row)


async def remove(session: AsyncSession, row: UserRow, code: str, deed: Deed, vault: Vault) -> None:
    """By its user, who still has it. Raises WrongCode."""
    await _prove(session, row, code, deed, vault)
    await reset(session, row, deed)


async def reset(session: AsyncSession, row: UserRow, deed: Deed) -> None:
    """By an admin, for somebody who has lost it. Harmless where there is none."""
    had_one = row.totp_sealed is not None
    row.totp_sealed = row.totp_pending_sealed = row.totp_last_step = None
    await session.execute(delete(RecoveryCodeRow).where(RecoveryCodeRow.user_id == row.id))
    if had_one:
        deed.record(session, "user.second_factor_off", user_id=row.id, user=row.name)


async def _prove(session: AsyncSession, row: UserRow, code: str, deed: Deed, vault: Vault) -> None:
    if row.totp_sealed is None:
        raise NoSecondFactorBegun
    if not await spend(session, row, code, deed.at, vault):
        raise WrongCode


async def _new_codes(session: AsyncSession, row: UserRow) -> list[str]:
    await session.execute(delete(RecoveryCodeRow).where(RecoveryCodeRow.user_id == row.id))
    codes = totp.new_recovery_codes()
    session.add_all(RecoveryCodeRow(user_id=row.id, code_hash=totp.hash_recovery_code(code)) for code in codes)
    return codes
