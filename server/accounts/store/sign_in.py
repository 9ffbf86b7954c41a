"""Sign-in: throttle, password, second factor, session, audit, in this order. Independent of HTTP."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from server.accounts.core.throttle import SignInThrottle
from server.accounts.store.passwords import Passwords
from server.accounts.store.second_factor import WrongCode, factors_of, spend
from server.accounts.store.sessions import NewSession, Sessions, end_session
from server.accounts.store.tables import UserRow
from server.accounts.store.users import SignInThrottled, WrongSignIn, find_user
from server.audit.store.trail import Actor, record
from server.kernel.names import name_key
from server.kernel.people import Principal
from server.kernel.refusal import Refusal
from server.runtime.vault import Vault
from server.storage.database import Database

_KINDS: Final = {"code": "the code of your authenticator", "passkey": "your passkey"}


class SecondFactorNeeded(Refusal):
    """Name and password are right, and the account has a second factor. `more` lists its kinds."""

    def __init__(self, kinds: Sequence[str] = ("code",)) -> None:
        words = " or ".join(_KINDS[kind] for kind in kinds)
        super().__init__(f"{words} is needed too, or a recovery code")
        self.more = {"kinds": list(kinds)}


class WrongSecondFactor(WrongCode):
    """At sign-in: as WrongCode, and no one is signed in."""


class WrongPassword(Refusal):
    """A signed-in user gave a wrong password for their own account."""

    def __init__(self) -> None:
        super().__init__("this is not your password")


SecondProof = Callable[[int], Awaitable[None]]
"""Checks what replaces a code, for the user with this id; raises a refusal if it is not valid."""


@dataclass(frozen=True)
class SignedIn:
    user: UserRow
    session: NewSession
    ended_session_id: int | None
    """The session that the browser had before."""


@dataclass(frozen=True)
class SignInService:
    database: Database
    passwords: Passwords
    sessions: Sessions
    throttle: SignInThrottle
    vault: Vault

    async def sign_in(
        self,
        *,
        name: str,
        password: str,
        code: str | None,
        old_token: str | None,
        address: str,
        user_agent: str,
        now: datetime,
        instead_of_code: SecondProof | None = None,
    ) -> SignedIn:
        """Raises SignInThrottled, WrongSignIn, SecondFactorNeeded, WrongSecondFactor and the refusals of
        `instead_of_code`."""
        name = name.strip()
        self._throttle(name, address, now)
        caller = self.throttle.caller(name=name_key(name), address=address, now_s=now.timestamp())
        async with self.database.reading() as session:
            user = await find_user(session, name)
        known_hash = user.password_hash if user else None
        right = await self.passwords.verify(password, known_hash, caller=caller)
        if user is None or not right or user.disabled:
            # The typed name may be a password by mistake: only existing names are recorded.
            why = "unknown name" if not user else "disabled" if right else "wrong password"
            await self._refused(user, why, address, now)
            raise WrongSignIn
        if user.has_second_factor:
            if instead_of_code is not None:
                await instead_of_code(user.id)
            elif not code:
                # Only the user should know the password: the record shows them a use by somebody else.
                await self._note(user, "session.code_awaited", {}, address, now)
                raise SecondFactorNeeded(factors_of(user))  # still counts: it is no cheaper than a wrong one
        new_hash = await self.passwords.hash(password) if self.passwords.needs_rehash(user.password_hash) else None
        is_proved = user.has_second_factor and instead_of_code is not None
        done = await self._begin(name, known_hash, new_hash, code, is_proved, old_token, address, user_agent, now)
        if done is None:
            await self._refused(user, "wrong code", address, now)
            raise WrongSecondFactor
        self.throttle.succeeded(name=name_key(name), address=address)
        return done

    async def check_own_password(self, *, user: UserRow, password: str, address: str, now: datetime) -> None:
        """For a signed-in user, before actions that a stolen cookie must not allow. Raises WrongPassword."""
        self._throttle(user.name, address, now)
        if not await self.passwords.verify(password, user.password_hash):
            await self._refused(user, "wrong password", address, now)
            raise WrongPassword
        self.throttle.succeeded(name=name_key(user.name), address=address)

    async def _begin(
        self,
        name: str,
        known_hash: str | None,
        new_hash: str | None,
        code: str | None,
        is_proved: bool,
        old_token: str | None,
        address: str,
        user_agent: str,
        now: datetime,
    ) -> SignedIn | None:
        """Always begins a new session with a new token and ends the browser's old one. Returns None if the code is
        wrong; `is_proved`: no code is needed."""
        async with self.database.writing() as session:
            fresh = await find_user(session, name)
            if fresh is None or fresh.disabled or fresh.password_hash != known_hash:
                raise WrongSignIn  # changed during the check of the password
            needs_code = fresh.has_second_factor and not is_proved
            if needs_code and not await spend(session, fresh, code or "", now, self.vault):
                return None
            if new_hash is not None:
                fresh.password_hash = new_hash
            ended = await end_session(session, old_token) if old_token else None
            begun = await self.sessions.begin(
                session, user_id=fresh.id, now=now, address=address, user_agent=user_agent
            )
            record(session, at=now, actor=Actor(fresh.id, fresh.name), action="session.began", address=address)
        return SignedIn(fresh, begun, ended.id if ended else None)

    def throttle_codes(self, principal: Principal, address: str, now: datetime) -> None:
        """Call it before checking a code of a signed-in user. Raises SignInThrottled."""
        self._throttle(_of_codes(principal), address, now)

    def code_was_right(self, principal: Principal, address: str) -> None:
        """The counterpart of `throttle_codes`."""
        self.throttle.succeeded(name=name_key(_of_codes(principal)), address=address)

    def _throttle(self, name: str, address: str, now: datetime) -> None:
        wait_s = self.throttle.begin(name=name_key(name), address=address, now_s=now.timestamp())
        if wait_s > 0:
            raise SignInThrottled(retry_after_s=wait_s)

    async def _refused(self, user: UserRow | None, why: str, address: str, now: datetime) -> None:
        await self._note(user, "session.refused", {"why": why}, address, now)

    async def _note(
        self, user: UserRow | None, action: str, detail: dict[str, str], address: str, now: datetime
    ) -> None:
        actor = Actor(user.id if user else None, user.name if user else "unknown")
        async with self.database.writing() as session:
            record(session, at=now, actor=actor, action=action, address=address, detail=detail)


def _of_codes(principal: Principal) -> str:
    """Codes of an account are counted separately from its passwords: a right password must not clear wrong codes."""
    return f"{principal.name}\ncodes"
