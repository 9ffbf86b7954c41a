"""`/api/v1/session`, `/me` and `/sessions`: signing in and out, the signed-in user, and the user's sessions."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from server.accounts.api.passkey_requests import PasskeyRequestDep
from server.accounts.core.challenges import ChallengeOver
from server.accounts.core.relying_party import PasskeysUnavailable
from server.accounts.store.passkey_sign_in import PasskeyRefused, WrongPasskey
from server.accounts.store.password_policy import BadPassword, TooManyJudgements
from server.accounts.store.passwords import TooManySignIns
from server.accounts.store.sessions import NewSession, UnknownSession, find_session, list_sessions
from server.accounts.store.sign_in import SecondFactorNeeded, WrongPassword, WrongSecondFactor
from server.accounts.store.tables import SessionRow, UserRow
from server.accounts.store.users import SignInThrottled, UserChange, WrongSignIn, change_user, get_user
from server.accounts.store.views import Me, NewPassword, PasswordChange, PasswordJudgement, SignIn
from server.alerts.store.channels.browsers import end_browsers
from server.audit.store.action import AuditAction
from server.audit.store.trail import Actor
from server.http.access import Anybody, InPerson, PasswordChanger, Proved, Prover
from server.http.authentication import COOKIE
from server.http.dependencies import (
    AddressDep,
    AuditDep,
    ClockDep,
    DatabaseDep,
    EventHandlerDep,
    HubDep,
    PasskeySignInDep,
    PasswordPolicyDep,
    PasswordsDep,
    RosterDep,
    SessionsDep,
    SettingsDep,
    SignInDep,
)
from server.http.long_list import long_list
from server.http.problem_docs import answers
from server.kernel.access import (
    AccessRequest,
    Action,
    AdminsOnly,
    BadToken,
    InPersonOnly,
    NotSignedIn,
    SessionExpired,
    judge,
    reaches,
)
from server.runtime.settings import Settings
from wire.ids import UserId

router = APIRouter(prefix="/api/v1", tags=["session"])


class SessionOwner(BaseModel):
    id: int
    name: str


class SessionView(BaseModel):
    """A signed-in browser."""

    id: int
    user: SessionOwner
    created_at: datetime
    last_seen_at: Annotated[datetime, Field(description="To the minute")]
    expires_at: Annotated[datetime, Field(description="When it ends without further use")]
    address: str
    user_agent: str
    current: Annotated[bool, Field(description="This session")]
    live: Annotated[int, Field(description="Open live connections")]


@router.post(
    "/session",
    responses=answers(
        WrongSignIn,
        SecondFactorNeeded,
        WrongSecondFactor,
        SignInThrottled,
        TooManySignIns,
        PasskeyRefused,
        ChallengeOver,
        PasskeysUnavailable,
    ),
)
async def sign_in(
    request: Request,
    response: Response,
    sign_in_service: SignInDep,
    passkey_sign_in: PasskeySignInDep,
    passkey_request: PasskeyRequestDep,
    sessions: SessionsDep,
    hub: HubDep,
    settings: SettingsDep,
    address: AddressDep,
    clock: ClockDep,
    body: SignIn,
) -> Me:
    """Checks name, password and second factor; sets a session cookie. Ends the session that the request already had."""

    async def instead_of_code(user_id: int) -> None:
        assert body.passkey is not None and asked is not None
        try:
            await passkey_sign_in.accept(
                body.passkey.model_dump(), ceremony=asked, user_id=user_id, address=address, now=clock()
            )
        except WrongPasskey:
            raise PasskeyRefused from None

    asked = None if body.passkey is None else passkey_request.of_sign_in()
    done = await sign_in_service.sign_in(
        name=body.name,
        password=body.password,
        code=body.code,
        old_token=request.cookies.get(COOKIE),
        address=address,
        user_agent=request.headers.get("user-agent", ""),
        now=clock(),
        instead_of_code=None if asked is None else instead_of_code,
    )
    if done.ended_session_id is not None:
        hub.end_sessions([done.ended_session_id])
    set_session_cookie(request, response, done.session, settings)
    return Me.of(done.user, must_add=sessions.lacks_demanded_factor(done.user))


@router.delete("/session", status_code=204)
async def sign_out(
    request: Request, response: Response, database: DatabaseDep, clock: ClockDep, address: AddressDep, hub: HubDep
) -> None:
    """Ends the session and its live connections. Signing out twice is not an error."""
    token = request.cookies.get(COOKIE)
    if token:
        async with database.writing() as session:
            ended = await find_session(session, token)
            user = await session.get(UserRow, ended.user_id) if ended else None
            if ended is not None and user is not None:
                action = AuditAction(by=Actor(user.id, user.name), at=clock(), address=address)
                action.record(session, "session.ended")
                await end_browsers(session, action, session_id=ended.id)
            if ended is not None:
                await session.delete(ended)
        if ended is not None:
            hub.end_sessions([ended.id])
    response.delete_cookie(COOKIE, httponly=True, samesite="strict", secure=request.url.scheme == "https")


@router.get("/me", responses=answers(NotSignedIn, SessionExpired, BadToken))
async def me(principal: Anybody, database: DatabaseDep) -> Me:
    """Returns the signed-in user."""
    async with database.reading() as session:
        return Me.of(await get_user(session, principal.user_id), must_add=principal.must_add_second_factor)


@router.post(
    "/me/password",
    responses=answers(
        NotSignedIn, SessionExpired, InPersonOnly, WrongPassword, SignInThrottled, TooManySignIns, TooManyJudgements
    ),
)
async def change_own_password(
    request: Request,
    response: Response,
    principal: PasswordChanger,
    sign_in_service: SignInDep,
    password_policy: PasswordPolicyDep,
    passwords: PasswordsDep,
    sessions: SessionsDep,
    database: DatabaseDep,
    roster: RosterDep,
    event_handler: EventHandlerDep,
    hub: HubDep,
    settings: SettingsDep,
    audit: AuditDep,
    body: PasswordChange,
) -> Me:
    """Changes your password. Your other sessions end, and this one gets a new cookie.

    Your API tokens end as well, unless `keep_tokens` is true.
    """
    action = audit.action(principal)
    now, address = action.at, action.address
    async with database.reading() as session:
        user = await get_user(session, principal.user_id)
    await sign_in_service.check_own_password(user=user, password=body.old_password, address=address, now=now)
    await password_policy.check(body.new_password, user.name)
    if body.new_password == body.old_password:
        raise BadPassword("this is the old password: choose another one")
    change = UserChange(
        password_hash=await passwords.hash(body.new_password),
        must_change_password=False,
        keep_tokens=body.keep_tokens,
    )
    async with database.writing() as session:
        if (await get_user(session, user.id)).password_hash != user.password_hash:
            raise WrongPassword  # changed during the check
        ended = [one.id async for one, _ in list_sessions(session, user_id=user.id)]
        row = await change_user(session, user_id=user.id, change=change, action=action)
        agent = request.headers.get("user-agent", "")
        begun = await sessions.begin(session, user_id=row.id, now=now, address=address, user_agent=agent)
    if body.keep_tokens:
        hub.end_sessions(ended)
    else:
        hub.end_user(principal.user_id, "the password was changed")
    await roster.refresh()
    await event_handler.caught_up()  # drones flown with those sessions hold before the response
    set_session_cookie(request, response, begun, settings)
    return Me.of(row, must_add=sessions.lacks_demanded_factor(row))


@router.post("/me/password/judgement", responses=answers(NotSignedIn, SessionExpired, InPersonOnly, TooManyJudgements))
async def judge_own_password(
    principal: Prover, password_policy: PasswordPolicyDep, body: NewPassword
) -> PasswordJudgement:
    """Tells whether this would be accepted as your new password, for feedback while typing. Nothing is stored."""
    found = await password_policy.judge(body.password, principal.name)
    return PasswordJudgement(acceptable=found.acceptable, message=found.message)


@router.get(
    "/sessions",
    response_model=list[SessionView],
    responses=answers(NotSignedIn, SessionExpired, InPersonOnly, AdminsOnly),
)
async def get_sessions(
    principal: InPerson,
    database: DatabaseDep,
    sessions: SessionsDep,
    clock: ClockDep,
    hub: HubDep,
    everybody: Annotated[bool, Query(description="Admins: of all users")] = False,
) -> Response:
    """Lists your sessions, or those of all users, newest first."""
    verdict = judge(AccessRequest(principal, Action.SEE_CREDENTIALS, everybody=everybody))
    if verdict.refusal is not None:
        raise verdict.refusal
    now = clock()
    async with database.reading() as session:
        return await long_list(
            SessionView(
                id=row.id,
                user=SessionOwner(id=owner.id, name=owner.name),
                created_at=row.created_at,
                last_seen_at=row.last_seen_at,
                expires_at=ends_at,
                address=row.address,
                user_agent=row.user_agent,
                current=row.id == principal.session_id,
                live=hub.sockets_of(row.id),
            )
            async for row, owner in list_sessions(session, user_id=None if everybody else principal.user_id)
            if (ends_at := sessions.ends_at(created_at=row.created_at, last_seen_at=row.last_seen_at)) > now
        )


@router.delete(
    "/sessions/{session_id}",
    status_code=204,
    responses=answers(NotSignedIn, SessionExpired, InPersonOnly, UnknownSession),
)
async def end_one_session(
    principal: Proved,
    database: DatabaseDep,
    audit: AuditDep,
    hub: HubDep,
    event_handler: EventHandlerDep,
    session_id: Annotated[int, Path(ge=1, le=2**31 - 1)],
) -> None:
    """Ends one of your sessions; an admin can end any. Its live connections close at once."""
    async with database.writing() as session:
        row = await session.get(SessionRow, session_id)
        if row is None or not reaches(principal, Action.CHANGE_CREDENTIALS, UserId(row.user_id)):
            raise UnknownSession
        owner = await get_user(session, row.user_id)
        action = audit.action(principal)
        action.record(session, "session.ended", user_id=owner.id, user=owner.name, session_id=row.id)
        await end_browsers(session, action, session_id=row.id)
        await session.delete(row)
    hub.end_sessions([session_id])
    await event_handler.caught_up()  # drones flown with this session hold before the response


def set_session_cookie(request: Request, response: Response, begun: NewSession, settings: Settings) -> None:
    response.set_cookie(
        COOKIE,
        begun.token,
        max_age=int(settings.session_lifetime_s),
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )
