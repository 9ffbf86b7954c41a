"""Sessions: how the tower recognises a signed-in browser, and for how long. Independent of HTTP.

A session ends when it was idle for too long, is too old, or when its user signs out, is disabled or gets a new
password. The token is 256 random bits, so a plain SHA-256 of it is enough in the database.
"""

from __future__ import annotations

import asyncio
import hashlib
import secrets
from collections.abc import AsyncIterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final

from sqlalchemy import Select, bindparam, delete, or_, select, update
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import SessionRow, UserRow
from server.kernel.access import is_demanded_a_factor
from server.kernel.people import Principal, Role, SignInId
from server.kernel.refusal import Refusal
from server.storage.database import Database, DatabaseUnavailable
from server.storage.in_slices import slices
from wire.ids import UserId

SEEN_EVERY: Final = timedelta(minutes=1)
"""`last_seen_at` is written at most this often, because not every request is worth a write."""


class UnknownSession(Refusal):
    """The session does not exist, or belongs to another user. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("there is no such session")


@dataclass(frozen=True)
class NewSession:
    session_id: int
    token: str


def lacks_demanded_factor(role: Role, *, has_second_factor: bool, admins_need_one: bool) -> bool:
    """`admins_need_one`: the setting TOWER_ADMINS_NEED_SECOND_FACTOR."""
    return admins_need_one and is_demanded_a_factor(role) and not has_second_factor


def hash_token(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()


_FOUND: Final = select(
    SessionRow.id.label("session_id"),
    SessionRow.created_at,
    SessionRow.last_seen_at,
    SessionRow.proved_at,
    UserRow.id.label("user_id"),
    UserRow.name,
    UserRow.role,
    UserRow.disabled,
    UserRow.must_change_password,
    or_(UserRow.totp_sealed.is_not(None), UserRow.passkey_count > 0).label("has_second_factor"),
).join(UserRow, UserRow.id == SessionRow.user_id)
_BY_TOKEN: Final = _FOUND.where(SessionRow.token_hash == bindparam("token_hash"))
_SEEN: Final = (
    update(SessionRow.__table__)  # type: ignore[arg-type]
    .where(SessionRow.__table__.c.id == bindparam("seen_id"))
    .values(last_seen_at=bindparam("at"))
)
_BY_ID: Final = _FOUND.where(SessionRow.id == bindparam("session_id"))


class Sessions:
    def __init__(
        self, database: Database, *, idle_s: float, lifetime_s: float, admins_need_second_factor: bool = False
    ) -> None:
        self._database = database
        self._admins_need_factor = admins_need_second_factor
        self._seen: dict[int, datetime] = {}
        self._seen_turn = asyncio.Lock()
        self._idle = timedelta(seconds=idle_s)
        self._lifetime = timedelta(seconds=lifetime_s)

    def lacks_demanded_factor(self, user: UserRow) -> bool:
        return self._lacks_factor(Role(user.role), has_second_factor=user.has_second_factor)

    def _lacks_factor(self, role: Role, *, has_second_factor: bool) -> bool:
        return lacks_demanded_factor(
            role, has_second_factor=has_second_factor, admins_need_one=self._admins_need_factor
        )

    def ends_at(self, *, created_at: datetime, last_seen_at: datetime) -> datetime:
        return min(created_at + self._lifetime, last_seen_at + self._idle)

    async def find(self, token: str, now: datetime) -> Principal | None:
        """Returns the principal of this token, or None if it has no valid session. Counts as activity."""
        return await self._find(_BY_TOKEN, {"token_hash": hash_token(token)}, now, seen=True)

    async def check(self, session_id: int, now: datetime) -> Principal | None:
        """The same by id, for an open live connection, without counting as activity."""
        return await self._find(_BY_ID, {"session_id": session_id}, now, seen=False)

    async def touch(self, session_id: int, now: datetime) -> Principal | None:
        """The same by id, counting as activity."""
        return await self._find(_BY_ID, {"session_id": session_id}, now, seen=True)

    async def _find(
        self, query: Select[*tuple[Any, ...]], values: dict[str, Any], now: datetime, *, seen: bool
    ) -> Principal | None:
        async with self._database.querying() as connection:
            row = (await connection.execute(query, values)).one_or_none()
        if row is None:
            return None
        ends_at = self.ends_at(created_at=row.created_at, last_seen_at=row.last_seen_at)
        if row.disabled or now >= ends_at:
            return None
        if seen and now - row.last_seen_at >= SEEN_EVERY and self._database.answers.takes_writes():
            # Activity that cannot be written does not refuse a request: the next one writes it.
            with suppress(DatabaseUnavailable):
                await self._write_seen(row.session_id, now)
            ends_at = self.ends_at(created_at=row.created_at, last_seen_at=now)
        role = Role(row.role)
        return Principal(
            UserId(row.user_id),
            row.name,
            role,
            row.session_id,
            ends_at,
            proved_at=row.proved_at,
            must_change_password=row.must_change_password,
            must_add_second_factor=self._lacks_factor(role, has_second_factor=row.has_second_factor),
        )

    async def _write_seen(self, session_id: int, now: datetime) -> None:
        """Writes what has gathered behind the write before in one transaction: after a restart of the tower a thousand
        browsers return within seconds."""
        self._seen[session_id] = now
        async with self._seen_turn:
            if session_id not in self._seen:
                return  # written with the others
            gathered, self._seen = self._seen, {}
            async with self._database.writing() as session:
                connection = await session.connection()
                await connection.execute(_SEEN, [{"seen_id": one, "at": at} for one, at in gathered.items()])

    async def begin(
        self, session: AsyncSession, *, user_id: int, now: datetime, address: str, user_agent: str
    ) -> NewSession:
        """Begins a session for a user who has just proved their identity. Also deletes the expired sessions of all
        users."""
        await session.execute(
            delete(SessionRow).where(
                or_(SessionRow.created_at <= now - self._lifetime, SessionRow.last_seen_at <= now - self._idle)
            )
        )
        token = secrets.token_urlsafe(32)
        row = SessionRow(
            token_hash=hash_token(token),
            user_id=user_id,
            created_at=now,
            last_seen_at=now,
            proved_at=now,
            address=address[:64],
            user_agent=user_agent[:256],
        )
        session.add(row)
        await session.flush()
        return NewSession(row.id, token)


async def find_session(session: AsyncSession, token: str) -> SessionRow | None:
    """It may have expired."""
    return await session.scalar(select(SessionRow).where(SessionRow.token_hash == hash_token(token)))


async def end_session(session: AsyncSession, token: str) -> SessionRow | None:
    """Deletes the session with this token and returns it."""
    row = await find_session(session, token)
    if row is not None:
        await session.delete(row)
    return row


async def end_sessions_of(session: AsyncSession, user_id: int) -> None:
    await session.execute(delete(SessionRow).where(SessionRow.user_id == user_id))


async def void_proofs(session: AsyncSession, user_id: int, *, but: SignInId) -> None:
    """Requires a new proof in the other sessions of this user: theirs was given without the newest factor."""
    others = update(SessionRow).where(
        SessionRow.user_id == user_id, SessionRow.id != (but if isinstance(but, int) else 0)
    )
    await session.execute(others.values(proved_at=None))


async def list_sessions(
    session: AsyncSession, *, user_id: int | None = None
) -> AsyncIterator[tuple[SessionRow, UserRow]]:
    """Yields sessions with their users, newest first; of all users if `user_id` is None. Some may have expired."""
    query = select(SessionRow, UserRow).join(UserRow, UserRow.id == SessionRow.user_id).order_by(SessionRow.id.desc())
    if user_id is not None:
        query = query.where(SessionRow.user_id == user_id)
    async for some in slices(session, query):
        for row, owner in some:
            yield row, owner
