"""API tokens: how a program signs in for a user. Contains the rules; independent of HTTP.

A token has scopes, and at each use it allows what is in its scopes *and* what its owner may do at that time. It always
ends: at its date, by revocation, with a new password of its owner, and with its owner's account (disabled or deleted).
It is 256 random bits, so a plain SHA-256 of it is enough in the database.

Its uses are recorded in memory and written by `ApiTokens.write_uses` periodically: no request waits for that.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import AsyncIterator, Collection
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Final

import structlog
from sqlalchemy import ColumnElement, delete, select, update
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.sessions import hash_token, lacks_demanded_factor
from server.accounts.store.tables import ApiTokenRow, UserRow
from server.audit.store.action import AuditAction
from server.fleet.store.snapshot import begin_fleet_change
from server.kernel.access import TOKEN_SCOPES
from server.kernel.names import clean_name
from server.kernel.people import Principal, Role, TokenId
from server.kernel.refusal import Refusal
from server.kernel.scopes import Scope, scopes_in
from server.storage.database import Database
from server.storage.in_slices import slices
from wire.ids import UserId

PREFIX: Final = "twt_"
"""Lets people and secret scanners recognise a token."""
MAX_PER_USER: Final = 50
USUAL_LIFE: Final = timedelta(days=90)
"""The default, if the tower allows it."""
MAX_LIFETIME: Final = timedelta(days=365)
"""Upper limit of the setting TOWER_TOKEN_LONGEST_DAYS."""
WRITE_USES_EVERY_S: Final = 60.0
_log = structlog.get_logger(__name__)


class UnknownToken(Refusal):
    """The token does not exist, or belongs to another user. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("there is no such token")


class TooManyTokens(Refusal):
    def __init__(self) -> None:
        super().__init__(f"a user has at most {MAX_PER_USER} tokens: revoke one first")


class BadScopes(Refusal):
    """The scopes are not allowed for a token of this user."""


class BadExpiry(Refusal):
    """The time is not allowed as the end of a token."""


def scopes_of(row: ApiTokenRow) -> frozenset[Scope]:
    """Returns the scopes of the token, ignoring scopes that this version does not know."""
    return scopes_in(row.scopes)


async def create_token(
    session: AsyncSession,
    *,
    owner: UserRow,
    name: str,
    scopes: Collection[Scope],
    expires_at: datetime | None,
    action: AuditAction,
    longest: timedelta = MAX_LIFETIME,
) -> tuple[ApiTokenRow, str]:
    """Returns the row, and the token itself, which is shown only here. Without an end: USUAL_LIFE, or `longest`."""
    name = clean_name(name)
    if not scopes:
        raise BadScopes("a token needs at least one scope")
    beyond = set(scopes) - TOKEN_SCOPES[Role(owner.role)]
    if Scope.FLY in beyond:
        raise BadScopes("a token of an observer can have the scope watch only")
    if beyond:
        raise BadScopes("only an admin's token can have the scopes admin and metrics")
    if expires_at is None:
        expires_at = action.at + min(USUAL_LIFE, longest)
    if not action.at < expires_at <= action.at + longest:
        raise BadExpiry(f"a token ends in the future, within {longest.days} days")
    await begin_fleet_change(session)
    await _make_space(session, owner, action)
    secret = PREFIX + secrets.token_urlsafe(32)
    row = ApiTokenRow(
        token_hash=hash_token(secret),
        user_id=owner.id,
        name=name,
        scopes=" ".join(sorted(set(scopes))),
        created_at=action.at,
        expires_at=expires_at,
        last_used_at=None,
    )
    session.add(row)
    await session.flush()
    action.record(session, "token.created", **_about(row, owner), scopes=row.scopes, expires_at=expires_at.isoformat())
    return row, secret


async def list_tokens(
    session: AsyncSession, *, user_id: int | None = None
) -> AsyncIterator[tuple[ApiTokenRow, UserRow]]:
    """Yields tokens with their owners, sorted by id; of all users if `user_id` is None."""
    query = select(ApiTokenRow, UserRow).join(UserRow, UserRow.id == ApiTokenRow.user_id).order_by(ApiTokenRow.id)
    if user_id is not None:
        query = query.where(ApiTokenRow.user_id == user_id)
    async for some in slices(session, query):
        for row, owner in some:
            yield row, owner


async def revoke_token(session: AsyncSession, *, token_id: int, of_user: int | None, action: AuditAction) -> None:
    """`of_user`: the required owner; None for any. Raises UnknownToken."""
    await begin_fleet_change(session)
    row = await session.get(ApiTokenRow, token_id)
    if row is None or of_user not in (None, row.user_id):
        raise UnknownToken
    owner = await session.get_one(UserRow, row.user_id)
    action.record(session, "token.revoked", **_about(row, owner))
    await session.delete(row)


async def _make_space(session: AsyncSession, owner: UserRow, action: AuditAction) -> None:
    """Makes room for one more. Expired tokens are listed only while there is room."""
    kept = list(await session.scalars(select(ApiTokenRow).where(ApiTokenRow.user_id == owner.id)))
    if len(kept) < MAX_PER_USER:
        return
    over = [row for row in kept if row.expires_at <= action.at]
    if not over:
        raise TooManyTokens
    for row in over:
        action.record(session, "token.expired", **_about(row, owner))
        await session.delete(row)


def _about(row: ApiTokenRow, owner: UserRow) -> dict[str, Any]:
    return {"token_id": row.id, "token": row.name, "user_id": owner.id, "user": owner.name}


async def end_tokens_of(session: AsyncSession, user_id: int) -> None:
    """Ends the tokens of an account that is disabled or has a new password, for good."""
    await session.execute(delete(ApiTokenRow).where(ApiTokenRow.user_id == user_id))


@dataclass(frozen=True)
class TokenUse:
    at: datetime
    address: str | None
    """None: used on a connection that was already open."""


class ApiTokens:
    """Finds tokens, as `Sessions` does for sessions."""

    def __init__(self, database: Database, *, admins_need_second_factor: bool = False) -> None:
        self._database = database
        self._admins_need_factor = admins_need_second_factor
        self._uses: dict[int, TokenUse] = {}
        """Uses not written yet, by token id: at most one per token."""

    async def find(self, token: str, now: datetime, *, address: str) -> Principal | None:
        """Returns the principal of a token, or None if the token is not valid."""
        if not token.startswith(PREFIX):
            return None
        return await self._find(ApiTokenRow.token_hash == hash_token(token), now, address)

    async def touch(self, token_id: TokenId, now: datetime) -> Principal | None:
        """The same by id, for an open live connection."""
        return await self._find(ApiTokenRow.id == token_id.id, now, None)

    async def _find(self, condition: ColumnElement[bool], now: datetime, address: str | None) -> Principal | None:
        async with self._database.reading() as session:
            query = select(ApiTokenRow, UserRow).join(UserRow, UserRow.id == ApiTokenRow.user_id).where(condition)
            found = (await session.execute(query)).one_or_none()
        if found is None:
            return None
        row, owner = found
        if owner.disabled or now >= row.expires_at:
            return None
        if address is None and (noted := self._uses.get(row.id)) is not None:
            address = noted.address
        self._uses[row.id] = TokenUse(now, address)
        return Principal(
            UserId(owner.id),
            owner.name,
            Role(owner.role),
            TokenId(row.id),
            row.expires_at,
            scopes=scopes_of(row),
            must_change_password=owner.must_change_password,
            must_add_second_factor=lacks_demanded_factor(
                Role(owner.role),
                has_second_factor=owner.has_second_factor,
                admins_need_one=self._admins_need_factor,
            ),
        )

    async def write_uses(self) -> None:
        """Writes the time and address of the last use of each token used since the last call. Uses that cannot be
        written stay for the next call."""
        uses, self._uses = self._uses, {}
        if not uses:
            return
        try:
            async with self._database.writing() as session:
                for token_id, use in uses.items():
                    values: dict[str, Any] = {"last_used_at": use.at}
                    if use.address is not None:
                        values["last_used_address"] = use.address[:64]
                    await session.execute(update(ApiTokenRow).where(ApiTokenRow.id == token_id).values(values))
        except SQLAlchemyError:
            self._uses = uses | self._uses
            _log.warning("token_uses_not_written", exc_info=True)

    async def keep_writing_uses(self) -> None:
        """Never returns; whoever stops it writes the last uses."""
        while True:
            await asyncio.sleep(WRITE_USES_EVERY_S)
            await self.write_uses()
