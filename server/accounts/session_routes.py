"""`/api/v1/session` and `/api/v1/me`: signing in, signing out, and who am I."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from server.access import COOKIE, Anybody, BadToken, NotSignedIn, SessionExpired
from server.accounts.passwords import TooManySignIns
from server.accounts.sessions import end_session
from server.accounts.tables import Role, UserRow
from server.accounts.users import SignInThrottled, WrongSignIn
from server.accounts.views import SignIn, UserView
from server.audit.trail import Actor, record
from server.problem_docs import answers
from server.tower import address_of, tower_of

router = APIRouter(prefix="/api/v1", tags=["session"])


@router.post("/session", responses=answers(WrongSignIn, SignInThrottled, TooManySignIns))
async def sign_in(request: Request, response: Response, body: SignIn) -> UserView:
    """Checks name and password and answers with a session cookie. A session that the request had is ended."""
    tower = tower_of(request)
    done = await tower.door.sign_in(
        name=body.name,
        password=body.password,
        old_token=request.cookies.get(COOKIE),
        address=address_of(request),
        user_agent=request.headers.get("user-agent", ""),
        now=tower.clock(),
    )
    if done.ended_session_id is not None:
        tower.hub.end_sessions([done.ended_session_id])
    response.set_cookie(
        COOKIE,
        done.session.token,
        max_age=int(tower.settings.session_lifetime_s),
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )
    return UserView(id=done.user_id, name=done.name, role=done.role)


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
async def me(principal: Anybody) -> UserView:
    """Who is signed in."""
    return UserView(id=principal.user_id, name=principal.name, role=Role(principal.role))
