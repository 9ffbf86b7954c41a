"""`/api/v1/me/second-factor`: codes of an authenticator as a second factor of one's own account, in person only."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field

from server.access import InPerson, InPersonOnly, NotSignedIn, SessionExpired
from server.accounts import second_factor, totp
from server.accounts.passwords import TooManySignIns
from server.accounts.second_factor import NoSecondFactorBegun, SecondFactorOn, WrongCode
from server.accounts.sessions import Principal
from server.accounts.sign_in import WrongPassword
from server.accounts.tables import UserRow
from server.accounts.users import SignInThrottled, get_user
from server.accounts.views import CodeProof, OwnPassword, PasswordAndCode
from server.audit.deed import Deed
from server.problem_docs import answers
from server.tower import address_of, tower_of

router = APIRouter(
    prefix="/api/v1/me/second-factor",
    tags=["session"],
    responses=answers(NotSignedIn, SessionExpired, InPersonOnly),
)
_PROVED = (WrongPassword, SignInThrottled, TooManySignIns)


class SecondFactorView(BaseModel):
    enabled: bool
    recovery_codes_left: int


class SecondFactorBegun(BaseModel):
    """To be put into an authenticator. Only this answer contains it."""

    secret: Annotated[str, Field(description="In base32, to type it in")]
    uri: Annotated[str, Field(description="The same, as otpauth://")]
    qr_svg: Annotated[str, Field(description="The same, as a picture: an <svg> element")]


class RecoveryCodes(BaseModel):
    """Only this answer contains them."""

    recovery_codes: list[str]


def _deed(request: Request, principal: Principal) -> Deed:
    return Deed(by=principal, at=tower_of(request).clock(), address=address_of(request))


async def _checked(request: Request, principal: Principal, password: str) -> UserRow:
    tower = tower_of(request)
    async with tower.database.reading() as session:
        user = await get_user(session, principal.user_id)
    address = address_of(request)
    await tower.door.check_own_password(user=user, password=password, address=address, now=tower.clock())
    return user


@router.get("")
async def get_second_factor(request: Request, principal: InPerson) -> SecondFactorView:
    """Whether there is one."""
    async with tower_of(request).database.reading() as session:
        row = await get_user(session, principal.user_id)
        left = await second_factor.codes_left(session, row.id)
    return SecondFactorView(enabled=row.totp_sealed is not None, recovery_codes_left=left)


@router.post("", responses=answers(SecondFactorOn, *_PROVED))
async def begin_second_factor(request: Request, principal: InPerson, body: OwnPassword) -> SecondFactorBegun:
    """Makes a secret for an authenticator. It counts for nothing until it is confirmed."""
    await _checked(request, principal, body.password)
    async with tower_of(request).database.writing() as session:
        row = await get_user(session, principal.user_id)
        secret = second_factor.begin(row, tower_of(request).vault)
    uri = totp.provisioning_uri(secret, row.name)
    return SecondFactorBegun(secret=secret, uri=uri, qr_svg=totp.qr_svg(uri))


@router.post("/confirm", responses=answers(SecondFactorOn, NoSecondFactorBegun, WrongCode, SignInThrottled))
async def confirm_second_factor(request: Request, principal: InPerson, body: CodeProof) -> RecoveryCodes:
    """From here on the code is asked for at each sign-in. Tells the recovery codes, once."""
    tower = tower_of(request)
    tower.door.throttle_codes(principal, address_of(request), tower.clock())
    async with tower.database.writing() as session:
        row = await get_user(session, principal.user_id)
        codes = await second_factor.confirm(session, row, body.code, _deed(request, principal), tower.vault)
    tower.door.code_was_right(principal, address_of(request))
    return RecoveryCodes(recovery_codes=codes)


@router.post("/recovery-codes", responses=answers(NoSecondFactorBegun, WrongCode, *_PROVED))
async def renew_recovery_codes(request: Request, principal: InPerson, body: PasswordAndCode) -> RecoveryCodes:
    """New recovery codes. The old ones are worth nothing from then on."""
    tower = tower_of(request)
    await _checked(request, principal, body.password)
    tower.door.throttle_codes(principal, address_of(request), tower.clock())
    async with tower.database.writing() as session:
        row = await get_user(session, principal.user_id)
        codes = await second_factor.renew_codes(session, row, body.code, _deed(request, principal), tower.vault)
    tower.door.code_was_right(principal, address_of(request))
    return RecoveryCodes(recovery_codes=codes)


@router.post("/remove", status_code=204, responses=answers(NoSecondFactorBegun, WrongCode, *_PROVED))
async def remove_second_factor(request: Request, principal: InPerson, body: PasswordAndCode) -> None:
    """The account is back to its password alone."""
    tower = tower_of(request)
    await _checked(request, principal, body.password)
    tower.door.throttle_codes(principal, address_of(request), tower.clock())
    async with tower.database.writing() as session:
        row = await get_user(session, principal.user_id)
        await second_factor.remove(session, row, body.code, _deed(request, principal), tower.vault)
    tower.door.code_was_right(principal, address_of(request))
