"""`/api/v1/session/passkey` and `/api/v1/me/passkeys`: signing in with a passkey, and one's own passkeys."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import APIRouter, Path, Request, Response

from server.api.access import COOKIE, FactorSetter, InPerson, Proved
from server.api.accounts.passkey_requests import ask_at_the_door, asked_at_the_door, asked_of, challenge_for
from server.api.accounts.second_factor_routes import is_factor_demanded
from server.api.accounts.session_routes import set_session_cookie
from server.api.http.problem_docs import answers
from server.api.tower import address_of, tower_of
from server.domain.access import InPersonOnly, NotSignedIn, SessionExpired
from server.domain.names import clean_name
from server.domain.people import Principal
from server.live.accounts import webauthn_check
from server.live.accounts.challenges import ChallengeOver, Purpose, TooManyChallenges
from server.live.accounts.relying_party import PasskeysUnavailable
from server.live.accounts.webauthn_check import PasskeyFault
from server.store.accounts import passkeys
from server.store.accounts.passkey_sign_in import PasskeyRefused, PasswordNeeded, WrongPasskey
from server.store.accounts.passkey_views import (
    NewPasskey,
    PasskeyAdded,
    PasskeyOptions,
    PasskeyRename,
    PasskeySignIn,
    PasskeyView,
)
from server.store.accounts.passkeys import PasskeyKnown, TooManyPasskeys, UnknownPasskey
from server.store.accounts.second_factor import LastFactor
from server.store.accounts.sessions import void_proofs
from server.store.accounts.views import Me
from server.store.audit.action import AuditAction

router = APIRouter(prefix="/api/v1", tags=["session"])

PasskeyPath = Annotated[int, Path(ge=1, le=2**31 - 1)]
_OWN: Final = (NotSignedIn, SessionExpired, InPersonOnly)


def _action(request: Request, principal: Principal) -> AuditAction:
    return AuditAction(by=principal, at=tower_of(request).clock(), address=address_of(request))


@router.post("/session/passkey/options", responses=answers(PasskeysUnavailable, TooManyChallenges))
async def ask_for_passkey(request: Request, response: Response) -> PasskeyOptions:
    """Begins a sign-in with a passkey. The answer is the same whoever is about to sign in."""
    asked = ask_at_the_door(request, response)
    challenge = challenge_for(request, asked)
    return PasskeyOptions(public_key=webauthn_check.request_options(asked.party, challenge=challenge))


@router.post(
    "/session/passkey",
    responses=answers(PasskeyRefused, PasswordNeeded, ChallengeOver, PasskeysUnavailable),
)
async def sign_in_with_passkey(request: Request, response: Response, body: PasskeySignIn) -> Me:
    """Signs in with a passkey alone: it stands for the password and the second factor. A session that the request had
    is ended."""
    tower = tower_of(request)
    done = await tower.passkey_sign_in.sign_in(
        body.credential.model_dump(),
        asked=asked_at_the_door(request),
        old_token=request.cookies.get(COOKIE),
        address=address_of(request),
        user_agent=request.headers.get("user-agent", ""),
        now=tower.clock(),
    )
    if done.ended_session_id is not None:
        tower.hub.end_sessions([done.ended_session_id])
    set_session_cookie(request, response, done.session)
    return Me.of(done.user, must_add=tower.sessions.lacks_demanded_factor(done.user))


@router.get("/me/passkeys", responses=answers(*_OWN))
async def list_passkeys(request: Request, principal: InPerson) -> list[PasskeyView]:
    """One's own passkeys, in the order in which they were added."""
    async with tower_of(request).database.reading() as session:
        return [PasskeyView.of(row) for row in await passkeys.list_passkeys(session, principal.user_id)]


@router.post("/me/passkeys/options", responses=answers(*_OWN, PasskeysUnavailable, TooManyChallenges, TooManyPasskeys))
async def begin_passkey(request: Request, principal: FactorSetter) -> PasskeyOptions:
    """Begins adding a passkey. Nothing changes before `POST /me/passkeys`."""
    asked = asked_of(request, principal, Purpose.ADD)
    async with tower_of(request).database.writing() as session:
        user, there = await passkeys.begin_adding(session, principal.user_id)
    options = webauthn_check.creation_options(
        asked.party,
        challenge=challenge_for(request, asked),
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
async def add_passkey(request: Request, principal: FactorSetter, body: NewPasskey) -> PasskeyAdded:
    """Adds what the browser has made. With the first factor of an account come recovery codes, told this once.

    The user's other sessions prove anew who they are before they change credentials.
    """
    tower = tower_of(request)
    clean_name(body.name)  # before the challenge is used up
    asked = asked_of(request, principal, Purpose.ADD)
    try:
        challenge = tower.passkey_sign_in.use_challenge(
            body.credential.response.clientDataJSON, asked=asked, now=tower.clock()
        )
        new = webauthn_check.check_new(body.credential.model_dump(), challenge=challenge, party=asked.party)
    except PasskeyFault:
        raise WrongPasskey from None
    async with tower.database.writing() as session:
        row, codes = await passkeys.add(
            session,
            user_id=principal.user_id,
            new=new,
            name=body.name,
            party_id=asked.party.id,
            action=_action(request, principal),
        )
        await void_proofs(session, principal.user_id, but=principal.session_id)
    return PasskeyAdded(passkey=PasskeyView.of(row), recovery_codes=codes)


@router.patch("/me/passkeys/{passkey_id}", responses=answers(*_OWN, UnknownPasskey))
async def rename_passkey(
    request: Request, principal: Proved, passkey_id: PasskeyPath, body: PasskeyRename
) -> PasskeyView:
    """Gives a passkey another name."""
    async with tower_of(request).database.writing() as session:
        row = await passkeys.rename(
            session,
            user_id=principal.user_id,
            passkey_id=passkey_id,
            name=body.name,
            action=_action(request, principal),
        )
    return PasskeyView.of(row)


@router.delete("/me/passkeys/{passkey_id}", status_code=204, responses=answers(*_OWN, UnknownPasskey, LastFactor))
async def remove_passkey(request: Request, principal: Proved, passkey_id: PasskeyPath) -> None:
    """The tower forgets a passkey: it signs nobody in any more. The device may keep its half."""
    async with tower_of(request).database.writing() as session:
        await passkeys.remove(
            session,
            user_id=principal.user_id,
            passkey_id=passkey_id,
            action=_action(request, principal),
            is_demanded=is_factor_demanded(tower_of(request).settings, principal),
        )
