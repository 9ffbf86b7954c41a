"""The tower's key for web push (VAPID): browsers subscribe with its public half, and push services take messages for
them from nobody else. Made once; the private half is sealed in the database, so it is in a backup, and several towers
share it."""

from __future__ import annotations

from typing import Final

import structlog
from cryptography.hazmat.primitives.asymmetric.ec import (
    SECP256R1,
    EllipticCurvePrivateKey,
    derive_private_key,
    generate_private_key,
)
from sqlalchemy import delete
from sqlalchemy.ext.asyncio import AsyncSession

from server.alerts.io.push_encryption import base64url, read_base64url
from server.alerts.io.vapid import Vapid
from server.alerts.store.channels.tables import AlertChannelRow, PushKeyRow
from server.runtime.vault import Vault, VaultError
from server.storage.database import Database

_ABOUT: Final = "web push of the tower"
_log = structlog.get_logger(__name__)


class PushKey:
    """One instance per tower. Call `load` before the first delivery."""

    def __init__(self, contact: str) -> None:
        """`contact`: see `Vapid`."""
        self._contact = contact
        self._vapid: Vapid | None = None

    @property
    def vapid(self) -> Vapid:
        if self._vapid is None:
            raise RuntimeError("the tower's key for web push has not been loaded")
        return self._vapid

    async def load(self, vault: Vault, database: Database) -> None:
        """Opens the key, or makes the first one. The vault must have its keys. A key that cannot be opened any more is
        replaced, and the browsers that subscribed with it are forgotten: nothing reaches them, and they subscribe
        again."""
        async with database.writing() as session:
            self._vapid = Vapid(await _key_in(session, vault), self._contact)


async def _key_in(session: AsyncSession, vault: Vault) -> EllipticCurvePrivateKey:
    row = await session.get(PushKeyRow, 1)
    if row is not None:
        try:
            key = _read(vault.open(row.sealed_key, about=_ABOUT))
            if not vault.by_newest_key(row.sealed_key):
                row.sealed_key = vault.reseal(row.sealed_key)
            return key
        except VaultError as error:
            _log.warning("push_key_replaced", reason=str(error))
            await session.execute(delete(AlertChannelRow).where(AlertChannelRow.kind == "push"))
    made = generate_private_key(SECP256R1())
    sealed = vault.seal(_text(made), about=_ABOUT)
    if row is None:
        session.add(PushKeyRow(id=1, sealed_key=sealed))
    else:
        row.sealed_key = sealed
    return made


def _text(key: EllipticCurvePrivateKey) -> str:
    """The 32 bytes of the private number."""
    return base64url(key.private_numbers().private_value.to_bytes(32, "big"))


def _read(text: str) -> EllipticCurvePrivateKey:
    return derive_private_key(int.from_bytes(read_base64url(text), "big"), SECP256R1())
