"""The secrets of second factors in the database: all sealed, with the newest key, before the tower starts."""

from __future__ import annotations

from typing import Final

from sqlalchemy import or_, select

from server.accounts.store.tables import UserRow
from server.runtime.vault import Vault, VaultError
from server.storage.database import Database

_WHAT_TO_DO: Final = (
    "put the key back (TOWER_SECRET_KEYS, or the key file from the backup), or take the second factor from whoever has "
    "one with `tower user second-factor-off NAME`"
)


def about(user_id: int) -> str:
    """The purpose of a sealed secret: a secret moved to another account does not open."""
    return f"second factor of user {user_id}"


async def prepare_vault(vault: Vault, database: Database) -> None:
    """Finds the keys, or creates the first one if nothing has been sealed yet; reseals secrets of older keys.

    Raises VaultError, with a message for the operator of the tower, if a sealed secret cannot be opened.
    """
    found = vault.find_keys()
    async with database.reading() as session:
        has_one = or_(UserRow.totp_sealed.is_not(None), UserRow.totp_pending_sealed.is_not(None))
        users = list(await session.scalars(select(UserRow).where(has_one).order_by(UserRow.id)))
    if not users and not found:
        vault.make_key()
        return
    names = ", ".join(user.name for user in users[:5]) + (", ..." if len(users) > 5 else "")
    if not found:
        raise VaultError(f"second factors are sealed ({names}) and the key is missing: {vault.where}; {_WHAT_TO_DO}")
    older = []
    for user in users:
        for sealed in (user.totp_sealed, user.totp_pending_sealed):
            if sealed is not None:
                try:
                    vault.open(sealed, about=about(user.id))
                except VaultError as error:
                    raise VaultError(f"the second factor of {user.name}: {error}; {_WHAT_TO_DO}") from None
                if not vault.by_newest_key(sealed):
                    older.append(user.id)
    if older:
        await _reseal(vault, database, set(older))


async def _reseal(vault: Vault, database: Database, user_ids: set[int]) -> None:
    async with database.writing() as session:
        for user in await session.scalars(select(UserRow).where(UserRow.id.in_(user_ids)).with_for_update()):
            if user.totp_sealed is not None:
                user.totp_sealed = vault.reseal(user.totp_sealed)
            if user.totp_pending_sealed is not None:
                user.totp_pending_sealed = vault.reseal(user.totp_pending_sealed)
