"""After a restart: restores known users and addresses from the valid sessions."""

from __future__ import annotations

from sqlalchemy import select

from server.accounts.store.tables import SessionRow, UserRow
from server.anonymous.core.known_addresses import KnownAddresses
from server.anonymous.core.networks import origin_of
from server.storage.database import Database

MAX_SESSIONS = 5_000


async def remember_addresses(known: KnownAddresses, database: Database) -> None:
    """Loads the newest sessions, oldest first, so that the oldest are evicted first."""
    newest = (
        select(SessionRow.address, UserRow.name_key)
        .join(UserRow, UserRow.id == SessionRow.user_id)
        .order_by(SessionRow.last_seen_at.desc())
        .limit(MAX_SESSIONS)
    )
    async with database.reading() as session:
        found = list(await session.execute(newest))
    for address, name in reversed(found):
        known.remember(origin_of(address), name)
