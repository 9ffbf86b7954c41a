"""`/api/v1/session`, `/me` and `/sessions`: signing in and out, who am I, and where one is signed in."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from server.api.access import COOKIE, Anybody, InPerson, PasswordChanger, Proved, Prover
from server.api.accounts.passkey_requests import asked_at_the_door
from server.api.http.problem_docs import answers
from server.api.tower import address_of, tower_of
from server.domain.access import AdminsOnly, BadToken, InPersonOnly, NotSignedIn, SessionExpired
from server.domain.people import Role
from server.live.accounts.challenges import ChallengeOver
from server.live.accounts.relying_party import PasskeysUnavailable
from server.store.accounts.passkey_sign_in import PasskeyRefused, WrongPasskey
from server.store.accounts.passkey_views import PasskeyAnswer
from server.store.accounts.password_policy import BadPassword, TooManyJudgements
from server.store.accounts.passwords import TooManySignIns
from server.store.accounts.sessions import NewSession, UnknownSession, end_session, list_sessions
from server.store.accounts.sign_in import SecondFactorNeeded, SecondProof, WrongPassword, WrongSecondFactor
from server.store.accounts.tables import SessionRow, UserRow
from server.store.accounts.users import SignInThrottled, UserChange, WrongSignIn, change_user, get_user
from server.store.accounts.views import Me, NewPassword, PasswordChange, PasswordJudgement, SignIn
from server.store.audit.action import AuditAction
from server.store.audit.trail import Actor, record

router = APIRouter(prefix="/api/v1", tags=["session"])


class SessionOwner(BaseModel):
    id: int
    name: str


class SessionView(BaseModel):
    """A browser that is signed in."""

    id: int
    user: SessionOwner
    created_at: datetime
    last_seen_at: Annotated[datetime, Field(description="To the minute")]
    expires_at: Annotated[datetime, Field(description="When it ends if nothing more is heard of it")]
    address: str
    user_agent: str
    current: Annotated[bool, Field(description="The one that asks")]
    live: Annotated[int, Field(description="Its open live connections")]


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
async def sign_in(request: Request, response: Response, body: SignIn) -> Me:
    """Checks name, password and second factor; answers with a session cookie. A session that the request had ends."""
    tower = tower_of(request)
    done = await tower.door.sign_in(
        name=body.name,
        password=body.password,
        code=body.code,
        old_token=request.cookies.get(COOKIE),
        address=address_of(request),
        user_agent=request.headers.get("user-agent", ""),
        now=tower.clock(),
        instead_of_code=_with_passkey(request, body.passkey) if body.passkey is not None else None,
    )
    if done.ended_session_id is not None:
        tower.hub.end_sessions([done.ended_session_id])
    set_session_cookie(request, response, done.session)
    return Me.of(done.user, must_add=tower.sessions.lacks_demanded_factor(done.user))


@router.delete("/session", status_code=204)
async def sign_out(request: Request, response: Response) -> None:
    """Ends the session and its live connections. Signing out twice is no error."""
    tower = tower_of(request)
    token = request.cookies.get(COOKIE)
    if token:
        async with tower.database.writing() as session:
            ended = await end_session(session, token)
            user = await session.get(UserRow, ended.user_id) if ended else None
            if user is not None:
                record(
                    session,
                    at=tower.clock(),
                    actor=Actor(user.id, user.name),
                    action="session.ended",
                    address=address_of(request),
                )
        if ended is not None:
            tower.hub.end_sessions([ended.id])
    response.delete_cookie(COOKIE, httponly=True, samesite="strict", secure=request.url.scheme == "https")


@router.get("/me", responses=answers(NotSignedIn, SessionExpired, BadToken))
async def me(request: Request, principal: Anybody) -> Me:
    """Who is signed in."""
    async with tower_of(request).database.reading() as session:
        return Me.of(await get_user(session, principal.user_id), must_add=principal.must_add_second_factor)


@router.post(
    "/me/password",
    responses=answers(
        NotSignedIn, SessionExpired, InPersonOnly, WrongPassword, SignInThrottled, TooManySignIns, TooManyJudgements
    ),
)
async def change_own_password(
    request: Request, response: Response, principal: PasswordChanger, body: PasswordChange
) -> Me:
    """A new password of one's own. Every other session of the user ends, and this one gets a new cookie.

    The user's API tokens end as well, unless `keep_tokens` says otherwise.
    """
    tower = tower_of(request)
    now, address = tower.clock(), address_of(request)
    async with tower.database.reading() as session:
        user = await get_user(session, principal.user_id)
    await tower.door.check_own_password(user=user, password=body.old_password, address=address, now=now)
    await tower.password_policy.check(body.new_password, user.name)
    if body.new_password == body.old_password:
        raise BadPassword("this is the old password: choose another one")
    change = UserChange(
        password_hash=await tower.passwords.hash(body.new_password),
        must_change_password=False,
        keep_tokens=body.keep_tokens,
    )
    async with tower.database.writing() as session:
        if (await get_user(session, user.id)).password_hash != user.password_hash:
            raise WrongPassword  # changed while it was being checked
        ended = [one.id for one, _ in await list_sessions(session, user_id=user.id)]
        row = await change_user(session, user_id=user.id, change=change, action=AuditAction(principal, now, address))
        agent = request.headers.get("user-agent", "")
        begun = await tower.sessions.begin(session, user_id=row.id, now=now, address=address, user_agent=agent)
    if body.keep_tokens:
        tower.hub.end_sessions(ended)
    else:
        tower.hub.end_user(principal.user_id, "the password was changed")
    await tower.roster.refresh()
    await tower.event_handler.caught_up()  # what was flown with them is held when this is answered
    set_session_cookie(request, response, begun)
    return Me.of(row, must_add=tower.sessions.lacks_demanded_factor(row))


@router.post("/me/password/judgement", responses=answers(NotSignedIn, SessionExpired, InPersonOnly, TooManyJudgements))
async def judge_own_password(request: Request, principal: Prover, body: NewPassword) -> PasswordJudgement:
    """Whether this would be taken as a new password of one's own: for saying so while one types. Nothing is kept."""
    found = await tower_of(request).password_policy.judge(body.password, principal.name)
    return PasswordJudgement(acceptable=found.acceptable, message=found.message)


@router.get("/sessions", responses=answers(NotSignedIn, SessionExpired, InPersonOnly, AdminsOnly))
async def get_sessions(
    request: Request,
    principal: InPerson,
    everybody: Annotated[bool, Query(description="Admins: also those of others")] = False,
) -> list[SessionView]:
    """Where one is signed in, or where everybody is; newest first."""
    if everybody and principal.role is not Role.ADMIN:
        raise AdminsOnly
    tower = tower_of(request)
    async with tower.database.reading() as session:
        found = await list_sessions(session, user_id=None if everybody else principal.user_id)
    views = []
    for row, owner in found:
        ends_at = tower.sessions.ends_at(created_at=row.created_at, last_seen_at=row.last_seen_at)
        if ends_at > tower.clock():
            views.append(
                SessionView(
                    id=row.id,
                    user=SessionOwner(id=owner.id, name=owner.name),
                    created_at=row.created_at,
                    last_seen_at=row.last_seen_at,
                    expires_at=ends_at,
                    address=row.address,
                    user_agent=row.user_agent,
                    current=row.id == principal.session_id,
                    live=tower.hub.sockets_of(row.id),
                )
            )
    return views


@router.delete(
    "/sessions/{session_id}",
    status_code=204,
    responses=answers(NotSignedIn, SessionExpired, InPersonOnly, UnknownSession),
)
async def end_one_session(
    request: Request, principal: Proved, session_id: Annotated[int, Path(ge=1, le=2**31 - 1)]
) -> None:
    """Ends a session of one's own, or as an admin anybody's. Its live connections close at once."""
    tower = tower_of(request)
    async with tower.database.writing() as session:
        row = await session.get(SessionRow, session_id)
        if row is None or (row.user_id != principal.user_id and principal.role is not Role.ADMIN):
            raise UnknownSession
        owner = await get_user(session, row.user_id)
        action = AuditAction(by=principal, at=tower.clock(), address=address_of(request))
        action.record(session, "session.ended", user_id=owner.id, user=owner.name, session_id=row.id)
        await session.delete(row)
    tower.hub.end_sessions([session_id])
    await tower.event_handler.caught_up()  # what was flown with it is held when this is answered


def _with_passkey(request: Request, answer: PasskeyAnswer) -> SecondProof:
    asked = asked_at_the_door(request)

    async def check(user_id: int) -> None:
        tower = tower_of(request)
        try:
            await tower.passkey_sign_in.accept(
                answer.model_dump(), asked=asked, user_id=user_id, address=address_of(request), now=tower.clock()
            )
        except WrongPasskey:
            raise PasskeyRefused from None

    return check


def set_session_cookie(request: Request, response: Response, begun: NewSession) -> None:
    response.set_cookie(
        COOKIE,
        begun.token,
        max_age=int(tower_of(request).settings.session_lifetime_s),
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )
