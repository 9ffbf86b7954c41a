"""The tower's own Ed25519 key: agents learn its public half at enrolment, and trust no other tower.

The private half is sealed in the database, so a copy of the database alone does not make a tower that drones obey.
"""

from __future__ import annotations

from typing import Final

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from sqlalchemy import delete
from sqlalchemy.ext.asyncio import AsyncSession

from server.fleet.store.tables import TowerIdentityRow
from server.runtime.vault import Vault, VaultError
from server.storage.database import Database
from wire.drone_key import key_bytes, key_text, public_half

_ABOUT: Final = "identity of the tower"
_WHAT_TO_DO: Final = (
    "put the key back (TOWER_SECRET_KEYS, or the key file from the backup), or give the tower a new identity with "
    "`tower forget-identity`: every drone must then be enrolled again"
)


class TowerIdentity:
    """One instance per tower. Call `load` before the first agent connects."""

    def __init__(self) -> None:
        self._private_key: Ed25519PrivateKey | None = None
        self.public_key = b""
        """32 bytes."""

    def sign(self, message: bytes) -> bytes:
        """64 bytes."""
        if self._private_key is None:
            raise RuntimeError("the tower's key has not been loaded")
        return self._private_key.sign(message)

    async def load(self, vault: Vault, database: Database) -> None:
        """Opens the key, or creates the first one. The vault must have its keys. Raises VaultError, with a message for
        the operator of the tower."""
        async with database.writing() as session:
            row = await session.get(TowerIdentityRow, 1)
            if row is None:
                made = Ed25519PrivateKey.generate()
                sealed = vault.seal(key_text(made.private_bytes_raw()), about=_ABOUT)
                row = TowerIdentityRow(id=1, public_key=key_text(public_half(made)), sealed_key=sealed)
                session.add(row)
            try:
                seed = key_bytes(vault.open(row.sealed_key, about=_ABOUT))
            except VaultError as error:
                raise VaultError(f"the tower's identity: {error}; {_WHAT_TO_DO}") from None
            if not vault.by_newest_key(row.sealed_key):
                row.sealed_key = vault.reseal(row.sealed_key)
        self._private_key = Ed25519PrivateKey.from_private_bytes(seed)
        self.public_key = public_half(self._private_key)


async def public_key_of(database: Database) -> str:
    """The public half as text; empty: there is no identity yet."""
    async with database.reading() as session:
        row = await session.get(TowerIdentityRow, 1)
        return "" if row is None else row.public_key


async def check_key_is_there(vault: Vault, database: Database) -> None:
    """Before a first key is created: raises VaultError if the tower's identity is sealed with a missing one."""
    if vault.find_keys():
        return
    async with database.reading() as session:
        if await session.get(TowerIdentityRow, 1) is not None:
            raise VaultError(f"the tower's identity is sealed and the key is missing: {vault.where}; {_WHAT_TO_DO}")


async def forget_identity(session: AsyncSession) -> None:
    """Deletes the identity: the next start creates a new one, which no drone knows."""
    await session.execute(delete(TowerIdentityRow))
