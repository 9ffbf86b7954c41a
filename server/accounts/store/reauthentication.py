"""A fresh proof of identity, required for every change of a password, factor, token, session or user.

A session remembers when its user last proved their identity, with every factor of the account. Signing in is such a
proof; `POST /api/v1/session/proof` renews it. It is valid for PROOF_MAX_AGE, for this session only. A token never has
one: a stolen cookie or token gives use of an account, but not control over it.

The kinds of proof are a table in `server/accounts/api/proof_routes.py`. A kind checks the evidence, limited by the same
throttle as sign-in, and then calls `renew`.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.second_factor import WrongCode, spend
from server.accounts.store.sessions import UnknownSession
from server.accounts.store.sign_in import SignInService, WrongPassword
from server.accounts.store.tables import SessionRow, UserRow
from server.accounts.store.users import get_user
from server.audit.store.action import AuditAction
from server.audit.store.trail import record
from server.kernel.access import PROOF_MAX_AGE
from server.kernel.people import Principal, TokenId
from server.kernel.refusal import Refusal


class CodeNeeded(Refusal):
    """The password is right, and the account needs a second factor."""

    def __init__(self) -> None:
        super().__init__("enter the code of your authenticator too, or a recovery code")


def fresh_until(proved_at: datetime | None) -> datetime | None:
    """Returns when a proof of that time expires; None without a proof."""
    return None if proved_at is None else proved_at + PROOF_MAX_AGE


async def renew(session: AsyncSession, principal: Principal, *, kind: str, action: AuditAction) -> None:
    """Records the proof in the session that gave it. In `Database.writing()`. Raises UnknownSession if it has ended."""
    if isinstance(principal.session_id, TokenId):
        raise UnknownSession
    row = await session.get(SessionRow, principal.session_id)
    if row is None or row.user_id != principal.user_id:
        raise UnknownSession
    row.proved_at = action.at
    action.record(session, "session.proved", session_id=row.id, kind=kind)


async def prove_by_password(
    service: SignInService, principal: Principal, *, password: str, code: str | None, action: AuditAction
) -> None:
    """Checks the password, and a code if the account has a second factor.

    Raises SignInThrottled, TooManySignIns, WrongPassword, CodeNeeded, WrongCode or UnknownSession.
    """
    async with service.database.reading() as session:
        user = await get_user(session, principal.user_id)
    await service.check_own_password(user=user, password=password, address=action.address, now=action.at)
    if user.has_second_factor:
        if not code:
            raise CodeNeeded
        service.throttle_codes(principal, action.address, action.at)
    if not await _renewed(service, principal, user, code or "", action):
        async with service.database.writing() as session:
            refused = {"why": "wrong code"}
            record(
                session, at=action.at, actor=action.by, action="session.refused", address=action.address, detail=refused
            )
        raise WrongCode
    if user.has_second_factor:
        service.code_was_right(principal, action.address)


async def _renewed(
    service: SignInService, principal: Principal, checked: UserRow, code: str, action: AuditAction
) -> bool:
    """Returns False if the code is wrong."""
    async with service.database.writing() as session:
        user = await get_user(session, principal.user_id)
        if user.password_hash != checked.password_hash or user.has_second_factor != checked.has_second_factor:
            raise WrongPassword  # changed during the check
        if user.has_second_factor and not await spend(session, user, code, action.at, service.vault):
            return False
        await renew(session, principal, kind="password", action=action)
    return True
