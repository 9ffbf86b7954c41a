"""`/api/v1/session/proof`: "confirm that it is you". Contains the table of the kinds of proof."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends
from pydantic import BaseModel, Discriminator, Field, Tag

from server.accounts.api.passkey_requests import PasskeyRequest, PasskeyRequestDep
from server.accounts.core.challenges import ChallengeOver, Purpose, TooManyChallenges
from server.accounts.core.relying_party import PasskeysUnavailable
from server.accounts.core.webauthn_values import CHECK
from server.accounts.store import passkeys
from server.accounts.store.passkey_sign_in import PasskeySignInService, WrongPasskey
from server.accounts.store.passkey_views import PasskeyAnswer, PasskeyOptions
from server.accounts.store.passwords import TooManySignIns
from server.accounts.store.reauthentication import CodeNeeded, fresh_until, prove_by_password, renew
from server.accounts.store.second_factor import WrongCode
from server.accounts.store.sessions import UnknownSession
from server.accounts.store.sign_in import SignInService, WrongPassword
from server.accounts.store.tables import SessionRow, UserRow
from server.accounts.store.users import SignInThrottled, get_user
from server.accounts.store.views import Code, Secret, Strict
from server.audit.store.action import AuditAction
from server.http.access import Prover
from server.http.dependencies import AuditDep, ClockDep, DatabaseDep, PasskeySignInDep, SignInDep
from server.http.problem_docs import answers
from server.kernel.access import InPersonOnly, NotSignedIn, SessionExpired, is_fresh
from server.kernel.people import Principal
from server.runtime.late_import import load_late
from server.storage.database import Database

router = APIRouter(
    prefix="/api/v1/session/proof", tags=["session"], responses=answers(NotSignedIn, SessionExpired, InPersonOnly)
)


ProofKind = Literal["passkey", "password"]


class PasswordProof(Strict):
    """The password, and a code of the second factor if the account has one."""

    kind: Literal["password"] = "password"
    password: Secret
    code: Code | None = None


class PasskeyProof(Strict):
    """A passkey of this account, in response to `POST /session/proof/passkey`."""

    kind: Literal["passkey"]
    credential: PasskeyAnswer


def _kind_of(proof: object) -> str:
    kind = proof.get("kind", "password") if isinstance(proof, dict) else getattr(proof, "kind", "password")
    return kind if isinstance(kind, str) else ""


Proof = Annotated[
    Annotated[PasswordProof, Tag("password")] | Annotated[PasskeyProof, Tag("passkey")], Discriminator(_kind_of)
]
"""A further kind is one more member of the union and one more line in PROOF_KINDS."""


@dataclass(frozen=True)
class _Checks:
    """Services that a check of evidence uses."""

    sign_in: SignInService
    passkey_sign_in: PasskeySignInService
    passkey_request: PasskeyRequest
    database: Database


async def _checks(
    sign_in: SignInDep, passkey_sign_in: PasskeySignInDep, passkey_request: PasskeyRequestDep, database: DatabaseDep
) -> _Checks:
    return _Checks(sign_in, passkey_sign_in, passkey_request, database)


_ChecksDep = Annotated[_Checks, Depends(_checks)]

Check = Callable[[_Checks, Principal, Any, AuditAction], Awaitable[None]]
"""Checks the evidence, throttled like a sign-in, and renews the session's proof. Raises a refusal otherwise."""


async def _by_password(checks: _Checks, principal: Principal, proof: PasswordProof, action: AuditAction) -> None:
    await prove_by_password(checks.sign_in, principal, password=proof.password, code=proof.code, action=action)


async def _by_passkey(checks: _Checks, principal: Principal, proof: PasskeyProof, action: AuditAction) -> None:
    """A passkey verifies its user, so it replaces the password and the code."""
    await checks.passkey_sign_in.accept(
        proof.credential.model_dump(),
        ceremony=checks.passkey_request.of_session(principal, Purpose.PROVE),
        user_id=principal.user_id,
        address=action.address,
        now=action.at,
    )
    async with checks.database.writing() as session:
        await renew(session, principal, kind="passkey", action=action)


PROOF_KINDS: Final[Mapping[str, Check]] = {"password": _by_password, "passkey": _by_passkey}


class ProofView(BaseModel):
    """How fresh this session's proof is, and how to renew it."""

    fresh: Annotated[bool, Field(description="The session may change credentials now")]
    fresh_until: Annotated[datetime | None, Field(description="null: there is no proof")]
    kinds: Annotated[list[ProofKind], Field(description="Accepted proofs of identity, best first")]
    code_needed: Annotated[bool, Field(description="The password needs the second factor's code")]

    @classmethod
    def of(cls, proved_at: datetime | None, user: UserRow, now: datetime) -> ProofView:
        return cls(
            fresh=is_fresh(proved_at, now),
            fresh_until=fresh_until(proved_at),
            kinds=kinds_of(user),
            code_needed=user.has_second_factor,
        )


def kinds_of(user: UserRow) -> list[ProofKind]:
    """Returns every kind of proof that this user can give, the best first."""
    return ["passkey", "password"] if user.passkey_count > 0 else ["password"]


@router.get("")
async def get_proof(principal: Prover, database: DatabaseDep, clock: ClockDep) -> ProofView:
    """Tells whether credentials may be changed now, and how to prove your identity."""
    async with database.reading() as session:
        user = await get_user(session, principal.user_id)
    return ProofView.of(principal.proved_at, user, clock())


@router.post(
    "",
    responses=answers(
        CodeNeeded,
        WrongPassword,
        WrongCode,
        WrongPasskey,
        ChallengeOver,
        PasskeysUnavailable,
        SignInThrottled,
        TooManySignIns,
        UnknownSession,
    ),
)
async def renew_proof(
    principal: Prover, audit: AuditDep, database: DatabaseDep, clock: ClockDep, checks: _ChecksDep, body: Proof
) -> ProofView:
    """Proves your identity again. Credentials may then be changed in this session for five minutes."""
    action = audit.action(principal)
    await PROOF_KINDS[body.kind](checks, principal, body, action)
    async with database.reading() as session:
        user = await get_user(session, principal.user_id)
        row = await session.get(SessionRow, principal.session_id)
    return ProofView.of(row.proved_at if row else None, user, clock())


@router.post("/passkey", responses=answers(PasskeysUnavailable, TooManyChallenges))
async def ask_for_proof_by_passkey(
    principal: Prover, database: DatabaseDep, passkey_request: PasskeyRequestDep
) -> PasskeyOptions:
    """Begins a proof by one of the account's passkeys. Send its answer to `POST /session/proof`."""
    ceremony = passkey_request.of_session(principal, Purpose.PROVE)
    async with database.reading() as session:
        own = await passkeys.list_passkeys(session, principal.user_id)
    allowed = [passkeys.known(one) for one in own if one.party_id == ceremony.party.id]
    await load_late(CHECK)
    from server.accounts.core import webauthn_check

    options = webauthn_check.request_options(
        ceremony.party, challenge=passkey_request.challenge_for(ceremony), allowed=allowed
    )
    return PasskeyOptions(public_key=options)
