"""Passkeys: as sign-in, as second factor beside a password, and as a fresh proof. Independent of HTTP.

No password is hashed here, so nothing queues behind attackers who guess passwords. A passkey with user verification
counts as both factors: possession, and what unlocks it.
"""

from __future__ import annotations

import hmac
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from server.accounts.core.challenges import Challenges, Purpose
from server.accounts.core.relying_party import RelyingParty
from server.accounts.core.webauthn_values import (
    CHECK,
    Assertion,
    PasskeyFault,
    challenge_in,
    from_base64url,
    to_base64url,
)
from server.accounts.store import passkeys
from server.accounts.store.sessions import Sessions, end_session
from server.accounts.store.sign_in import SignedIn
from server.accounts.store.tables import PasskeyRow, UserRow
from server.audit.store.trail import Actor, record
from server.kernel.refusal import Refusal
from server.runtime.late_import import load_late
from server.storage.database import Database


class PasskeyRefused(Refusal):
    """At sign-in: unknown, of another user, wrongly signed, or a copy. Deliberately does not say which."""

    def __init__(self) -> None:
        super().__init__("the passkey was not accepted: try again, or sign in with your password")


class WrongPasskey(PasskeyRefused):
    """The passkey of a signed-in user was not accepted."""

    def __init__(self) -> None:
        Refusal.__init__(self, "the passkey was not accepted: is it one of this account, and for this address?")


class PasswordNeeded(Refusal):
    """An admin has set a password: until its user has changed it, no passkey replaces it."""

    def __init__(self) -> None:
        super().__init__("an admin has given this account a new password: sign in with it, and then with your passkey")


@dataclass(frozen=True)
class PasskeyCeremony:
    """A request of the tower to a browser for a passkey; the response must match it."""

    purpose: Purpose
    asker: str
    party: RelyingParty


@dataclass(frozen=True)
class _Checked:
    passkey: PasskeyRow
    user: UserRow
    assertion: Assertion


@dataclass(frozen=True)
class PasskeySignInService:
    database: Database
    sessions: Sessions
    challenges: Challenges

    async def sign_in(
        self,
        credential: dict[str, Any],
        *,
        ceremony: PasskeyCeremony,
        old_token: str | None,
        address: str,
        user_agent: str,
        now: datetime,
    ) -> SignedIn:
        """Always begins a new session with a new token. Raises ChallengeOver, PasskeyRefused or PasswordNeeded."""
        checked = await self._check(credential, ceremony=ceremony, user_id=None, address=address, now=now)
        user = checked.user
        if user.must_change_password:
            raise PasswordNeeded
        try:
            async with self.database.writing() as session:
                passkey = await passkeys.use(session, checked.passkey.id, checked.assertion, now)
                fresh = await session.get(UserRow, user.id)
                if fresh is None or fresh.disabled or fresh.must_change_password:
                    raise PasskeyFault("changed meanwhile")
                ended = await end_session(session, old_token) if old_token else None
                begun = await self.sessions.begin(
                    session, user_id=fresh.id, now=now, address=address, user_agent=user_agent
                )
                record(
                    session,
                    at=now,
                    actor=Actor(fresh.id, fresh.name),
                    action="session.began",
                    address=address,
                    detail={"passkey_id": passkey.id, "passkey": passkey.name},
                )
        except PasskeyFault as fault:
            await self._refused(user, checked.passkey, fault.why, address, now)
            raise PasskeyRefused from None
        return SignedIn(fresh, begun, ended.id if ended else None)

    async def accept(
        self, credential: dict[str, Any], *, ceremony: PasskeyCeremony, user_id: int, address: str, now: datetime
    ) -> PasskeyRow:
        """Accepts a passkey of this user only, beside a password or as a fresh proof. Raises ChallengeOver or
        WrongPasskey."""
        try:
            checked = await self._check(credential, ceremony=ceremony, user_id=user_id, address=address, now=now)
        except PasskeyRefused:
            raise WrongPasskey from None
        try:
            async with self.database.writing() as session:
                return await passkeys.use(session, checked.passkey.id, checked.assertion, now)
        except PasskeyFault as fault:
            await self._refused(checked.user, checked.passkey, fault.why, address, now)
            raise WrongPasskey from None

    def use_challenge(self, client_data: str, *, ceremony: PasskeyCeremony, now: datetime) -> bytes:
        """Uses up the challenge. Raises ChallengeOver or PasskeyFault."""
        challenge = challenge_in(client_data)
        self.challenges.take(challenge, purpose=ceremony.purpose, asker=ceremony.asker, now_s=now.timestamp())
        return challenge

    async def _check(
        self, credential: dict[str, Any], *, ceremony: PasskeyCeremony, user_id: int | None, address: str, now: datetime
    ) -> _Checked:
        await load_late(CHECK)
        from server.accounts.core.webauthn_check import check_assertion

        response = credential["response"]
        try:
            challenge = self.use_challenge(response["clientDataJSON"], ceremony=ceremony, now=now)
            credential_id = from_base64url(credential["rawId"])
        except (PasskeyFault, ValueError):
            raise PasskeyRefused from None
        async with self.database.reading() as session:
            found = await passkeys.find(session, credential_id)
        if found is None:
            raise PasskeyRefused  # it belongs to no user, so there is no account to record it for
        passkey, user = found
        try:
            assertion = check_assertion(
                credential, challenge=challenge, party=ceremony.party, public_key=passkey.public_key
            )
            if user.disabled:
                raise PasskeyFault("disabled")
            if user_id is not None and user.id != user_id:
                raise PasskeyFault("of another user")
            handle = response.get("userHandle")
            if handle is None and user_id is None:
                raise PasskeyFault("no user handle")
            if handle is not None and not _same_handle(handle, user.passkey_handle):
                raise PasskeyFault("wrong user handle")
        except PasskeyFault as fault:
            await self._refused(user, passkey, fault.why, address, now)
            raise PasskeyRefused from None
        return _Checked(passkey, user, assertion)

    async def _refused(self, user: UserRow, passkey: PasskeyRow, why: str, address: str, now: datetime) -> None:
        async with self.database.writing() as session:
            record(
                session,
                at=now,
                actor=Actor(user.id, user.name),
                action="session.refused",
                address=address,
                detail={"why": f"passkey: {why}", "passkey_id": passkey.id, "passkey": passkey.name},
            )


def _same_handle(handle: str, known: bytes | None) -> bool:
    return hmac.compare_digest(handle, to_base64url(known or b""))
