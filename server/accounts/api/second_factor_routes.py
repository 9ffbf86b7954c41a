"""`/api/v1/me/second-factor`: codes of an authenticator app as the second factor of the user's own account.

With a session only, and with a fresh proof of identity (`reauthentication.py`).
"""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, Field

from server.accounts.core import totp
from server.accounts.store import second_factor
from server.accounts.store.second_factor import LastFactor, NoSecondFactorBegun, SecondFactorOn, WrongCode
from server.accounts.store.sessions import void_proofs
from server.accounts.store.users import SignInThrottled, get_user
from server.accounts.store.views import CodeProof
from server.http.access import FactorSetter, InPerson, Proved
from server.http.dependencies import (
    AddressDep,
    AuditDep,
    ClockDep,
    DatabaseDep,
    SettingsDep,
    SignInDep,
    VaultDep,
)
from server.http.problem_docs import answers
from server.kernel.access import InPersonOnly, NotSignedIn, SessionExpired, is_demanded_a_factor
from server.kernel.people import Principal
from server.runtime.settings import Settings

router = APIRouter(
    prefix="/api/v1/me/second-factor",
    tags=["session"],
    responses=answers(NotSignedIn, SessionExpired, InPersonOnly),
)


class SecondFactorView(BaseModel):
    enabled: Annotated[bool, Field(description="An authenticator is set up")]
    passkeys: Annotated[int, Field(description="Number of passkeys; each is a second factor too")]
    recovery_codes_left: int


class SecondFactorBegun(BaseModel):
    """A secret for an authenticator app. Only this response contains it."""

    secret: Annotated[str, Field(description="In base32, for typing")]
    uri: Annotated[str, Field(description="The same, as otpauth://")]
    qr_svg: Annotated[str, Field(description="The same, as a picture: an <svg> element")]


class RecoveryCodes(BaseModel):
    """Recovery codes. Only this response contains them."""

    recovery_codes: list[str]


def is_factor_demanded(settings: Settings, principal: Principal) -> bool:
    """Whether this account must keep at least one second factor."""
    return settings.admins_need_second_factor and is_demanded_a_factor(principal.role)


@router.get("")
async def get_second_factor(principal: InPerson, database: DatabaseDep) -> SecondFactorView:
    """Lists your second factors."""
    async with database.reading() as session:
        row = await get_user(session, principal.user_id)
        left = await second_factor.codes_left(session, row.id)
    return SecondFactorView(enabled=row.totp_sealed is not None, passkeys=row.passkey_count, recovery_codes_left=left)


@router.post("", responses=answers(SecondFactorOn))
async def begin_second_factor(principal: FactorSetter, database: DatabaseDep, vault: VaultDep) -> SecondFactorBegun:
    """Creates a secret for an authenticator app. It has no effect until it is confirmed."""
    async with database.writing() as session:
        row = await get_user(session, principal.user_id)
        secret = second_factor.begin(row, vault)
    uri = totp.provisioning_uri(secret, row.name)
    return SecondFactorBegun(secret=secret, uri=uri, qr_svg=totp.qr_svg(uri))


@router.post("/confirm", responses=answers(SecondFactorOn, NoSecondFactorBegun, WrongCode, SignInThrottled))
async def confirm_second_factor(
    principal: FactorSetter,
    sign_in: SignInDep,
    address: AddressDep,
    clock: ClockDep,
    database: DatabaseDep,
    audit: AuditDep,
    vault: VaultDep,
    body: CodeProof,
) -> RecoveryCodes:
    """Confirms the secret: every sign-in asks for a code from then on. Returns the recovery codes, shown only once.

    Your other sessions must prove your identity again before they can change credentials.
    """
    sign_in.throttle_codes(principal, address, clock())
    async with database.writing() as session:
        row = await get_user(session, principal.user_id)
        codes = await second_factor.confirm(session, row, body.code, audit.action(principal), vault)
        await void_proofs(session, row.id, but=principal.session_id)
    sign_in.code_was_right(principal, address)
    return RecoveryCodes(recovery_codes=codes)


@router.post("/recovery-codes", responses=answers(NoSecondFactorBegun))
async def renew_recovery_codes(principal: Proved, database: DatabaseDep, audit: AuditDep) -> RecoveryCodes:
    """Creates new recovery codes. The old ones become invalid."""
    async with database.writing() as session:
        row = await get_user(session, principal.user_id)
        codes = await second_factor.renew_codes(session, row, audit.action(principal))
    return RecoveryCodes(recovery_codes=codes)


@router.post("/remove", status_code=204, responses=answers(NoSecondFactorBegun, LastFactor))
async def remove_second_factor(
    principal: Proved, database: DatabaseDep, settings: SettingsDep, audit: AuditDep
) -> None:
    """Removes the authenticator app: the account is left with its password, or with its passkeys."""
    async with database.writing() as session:
        row = await get_user(session, principal.user_id)
        is_demanded = is_factor_demanded(settings, principal)
        await second_factor.remove(session, row, audit.action(principal), is_demanded=is_demanded)
