"""The check at the door: throttle, password, session, audit, in this order. Knows nothing of HTTP."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from server.accounts.passwords import Passwords
from server.accounts.sessions import NewSession, Sessions, end_session
from server.accounts.tables import Role
from server.accounts.throttle import SignInThrottle
from server.accounts.users import SignInThrottled, WrongSignIn, find_user
from server.audit.trail import Actor, record
from server.database import Database
from server.names import name_key


@dataclass(frozen=True)
class SignedIn:
    user_id: int
    name: str
    role: Role
    session: NewSession
    ended_session_id: int | None
    """The session that the browser had before."""


@dataclass(frozen=True)
class Door:
    database: Database
    passwords: Passwords
    sessions: Sessions
    throttle: SignInThrottle

    async def sign_in(
        self,
        *,
        name: str,
        password: str,
        old_token: str | None,
        address: str,
        user_agent: str,
        now: datetime,
    ) -> SignedIn:
        """Raises SignInThrottled or WrongSignIn."""
        name = name.strip()
        wait_s = self.throttle.begin(name=name_key(name), address=address, now_s=now.timestamp())
        if wait_s > 0:
            raise SignInThrottled(retry_after_s=wait_s)
        async with self.database.reading() as session:
            user = await find_user(session, name)
        known_hash = user.password_hash if user else None
        right = await self.passwords.verify(password, known_hash)
        if user is None or not right or user.disabled:
            # What was typed as a name may be a password by mistake: only names that exist are written down.
            async with self.database.writing() as session:
                record(
                    session,
                    at=now,
                    actor=Actor(user.id if user else None, user.name if user else "unknown"),
                    action="session.refused",
                    address=address,
                    detail={"why": "unknown name" if not user else "disabled" if right else "wrong password"},
                )
            raise WrongSignIn
        new_hash = await self.passwords.hash(password) if self.passwords.needs_rehash(user.password_hash) else None
        async with self.database.writing() as session:
            fresh = await find_user(session, name)
            if fresh is None or fresh.disabled or fresh.password_hash != known_hash:
                raise WrongSignIn  # changed while the password was being checked
            if new_hash is not None:
                fresh.password_hash = new_hash
            ended = await end_session(session, old_token) if old_token else None
            begun = await self.sessions.begin(
                session, user_id=fresh.id, now=now, address=address, user_agent=user_agent
            )
            record(session, at=now, actor=Actor(fresh.id, fresh.name), action="session.began", address=address)
        self.throttle.succeeded(name=name_key(name), address=address)
        return SignedIn(fresh.id, fresh.name, Role(fresh.role), begun, ended.id if ended else None)
