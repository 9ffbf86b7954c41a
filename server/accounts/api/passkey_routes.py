"""`/api/v1/session/passkey` and `/api/v1/me/passkeys`: sign-in with a passkey, and the user's own passkeys."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import APIRouter, Path, Request, Response

from server.accounts.api.passkey_requests import PasskeyRequestDep
from server.accounts.api.second_factor_routes import is_factor_demanded
from server.accounts.api.session_routes import set_session_cookie
from server.accounts.core.challenges import ChallengeOver, Purpose, TooManyChallenges
from server.accounts.core.relying_party import PasskeysUnavailable
from server.accounts.core.webauthn_values import CHECK, PasskeyFault
from server.accounts.store import passkeys
from server.accounts.store.passkey_sign_in import PasskeyRefused, PasswordNeeded, WrongPasskey
from server.accounts.store.passkey_views import (
    NewPasskey,
    PasskeyAdded,
    PasskeyOptions,
    PasskeyRename,
    PasskeySignIn,
    PasskeyView,
)
from server.accounts.store.passkeys import PasskeyKnown, TooManyPasskeys, UnknownPasskey
from server.accounts.store.second_factor import LastFactor
from server.accounts.store.sessions import void_proofs
from server.accounts.store.views import Me
from server.http.access import FactorSetter, InPerson, Proved
from server.http.authentication import COOKIE
from server.http.dependencies import (
    AddressDep,
    AuditDep,
    ClockDep,
    DatabaseDep,
    HubDep,
    PasskeySignInDep,
    SessionsDep,
    SettingsDep,
)
from server.http.problem_docs import answers
from server.kernel.access import InPersonOnly, NotSignedIn, SessionExpired
from server.kernel.names import clean_name
from server.runtime.late_import import load_late

router = APIRouter(prefix="/api/v1", tags=["session"])

PasskeyPath = Annotated[int, Path(ge=1, le=2**31 - 1)]
_OWN: Final = (NotSignedIn, SessionExpired, InPersonOnly)


@router.post("/session/passkey/options", responses=answers(PasskeysUnavailable, TooManyChallenges))
async def ask_for_passkey(response: Response, passkey_request: PasskeyRequestDep) -> PasskeyOptions:
    """Begins a sign-in with a passkey. The response does not depend on the user."""
    await load_late(CHECK)
    from server.accounts.core import webauthn_check

    ceremony = passkey_request.begin_sign_in(response)
    challenge = passkey_request.challenge_for(ceremony)
    return PasskeyOptions(public_key=webauthn_check.request_options(ceremony.party, challenge=challenge))


@router.post(
    "/session/passkey",
    responses=answers(PasskeyRefused, PasswordNeeded, ChallengeOver, PasskeysUnavailable),
)
async def sign_in_with_passkey(
    request: Request,
    response: Response,
    passkey_sign_in: PasskeySignInDep,
    address: AddressDep,
    clock: ClockDep,
    hub: HubDep,
    settings: SettingsDep,
    sessions: SessionsDep,
    passkey_request: PasskeyRequestDep,
    body: PasskeySignIn,
) -> Me:
    """Signs in with a passkey alone, which replaces the password and the second factor. Ends the session that the
    request already had, if any."""
    done = await passkey_sign_in.sign_in(
        body.credential.model_dump(),
        ceremony=passkey_request.of_sign_in(),
        old_token=request.cookies.get(COOKIE),
        address=address,
        user_agent=request.headers.get("user-agent", ""),
        now=clock(),
    )
    if done.ended_session_id is not None:
        hub.end_sessions([done.ended_session_id])
    set_session_cookie(request, response, done.session, settings)
    return Me.of(done.user, must_add=sessions.lacks_demanded_factor(done.user))


@router.get("/me/passkeys", responses=answers(*_OWN))
async def list_passkeys(principal: InPerson, database: DatabaseDep) -> list[PasskeyView]:
    """Lists your passkeys, oldest first."""
    async with database.reading() as session:
        return [PasskeyView.of(row) for row in await passkeys.list_passkeys(session, principal.user_id)]


@router.post("/me/passkeys/options", responses=answers(*_OWN, PasskeysUnavailable, TooManyChallenges, TooManyPasskeys))
async def begin_passkey(
    principal: FactorSetter, database: DatabaseDep, passkey_request: PasskeyRequestDep
) -> PasskeyOptions:
    """Begins adding a passkey. Nothing changes until `POST /me/passkeys`."""
    await load_late(CHECK)
    from server.accounts.core import webauthn_check

    ceremony = passkey_request.of_session(principal, Purpose.ADD)
    async with database.writing() as session:
        user, there = await passkeys.begin_adding(session, principal.user_id)
    options = webauthn_check.creation_options(
        ceremony.party,
        challenge=passkey_request.challenge_for(ceremony),
        user_handle=user.passkey_handle or b"",
        name=user.name,
        there=there,
    )
    return PasskeyOptions(public_key=options)


@router.post(
    "/me/passkeys",
    status_code=201,
    responses=answers(*_OWN, PasskeysUnavailable, ChallengeOver, WrongPasskey, PasskeyKnown, TooManyPasskeys),
)
async def add_passkey(
    principal: FactorSetter,
    passkey_sign_in: PasskeySignInDep,
    clock: ClockDep,
    database: DatabaseDep,
    audit: AuditDep,
    passkey_request: PasskeyRequestDep,
    body: NewPasskey,
) -> PasskeyAdded:
    """Adds the passkey that the browser has created. The first factor of an account comes with recovery codes, shown
    only once.

    Your other sessions must prove your identity again before they can change credentials.
    """
    clean_name(body.name)  # before the challenge is used up
    await load_late(CHECK)
    from server.accounts.core import webauthn_check

    ceremony = passkey_request.of_session(principal, Purpose.ADD)
    try:
        challenge = passkey_sign_in.use_challenge(
            body.credential.response.clientDataJSON, ceremony=ceremony, now=clock()
        )
        new = webauthn_check.check_new(body.credential.model_dump(), challenge=challenge, party=ceremony.party)
    except PasskeyFault:
        raise WrongPasskey from None
    async with database.writing() as session:
        row, codes = await passkeys.add(
            session,
            user_id=principal.user_id,
            new=new,
            name=body.name,
            party_id=ceremony.party.id,
            action=audit.action(principal),
        )
        await void_proofs(session, principal.user_id, but=principal.session_id)
    return PasskeyAdded(passkey=PasskeyView.of(row), recovery_codes=codes)


@router.patch("/me/passkeys/{passkey_id}", responses=answers(*_OWN, UnknownPasskey))
async def rename_passkey(
    principal: Proved, database: DatabaseDep, audit: AuditDep, passkey_id: PasskeyPath, body: PasskeyRename
) -> PasskeyView:
    """Renames a passkey."""
    async with database.writing() as session:
        row = await passkeys.rename(
            session,
            user_id=principal.user_id,
            passkey_id=passkey_id,
            name=body.name,
            action=audit.action(principal),
        )
    return PasskeyView.of(row)


@router.delete("/me/passkeys/{passkey_id}", status_code=204, responses=answers(*_OWN, UnknownPasskey, LastFactor))
async def remove_passkey(
    principal: Proved, database: DatabaseDep, audit: AuditDep, settings: SettingsDep, passkey_id: PasskeyPath
) -> None:
    """Removes a passkey from the tower: it can no longer sign in. The device may keep its half."""
    async with database.writing() as session:
        await passkeys.remove(
            session,
            user_id=principal.user_id,
            passkey_id=passkey_id,
            action=audit.action(principal),
            is_demanded=is_factor_demanded(settings, principal),
        )
