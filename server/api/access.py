"""Who may come in and what they may do: one judgement for REST, WebSocket, UDP and video alike.

Two ways to sign in: a browser's session cookie, for everything that its user may do, and an API token in the
`Authorization` header, for what its scopes say and its owner may do. `NEEDS` is the one table of which scopes an action
takes. Where a token comes with a request, no cookie of it is looked at.

Not theirs and not there get the same answer: `judge` is told how the user stands to a drone (`server.domain.relations`,
which has the table of who may do what with one), or None when there is no such drone, and refuses both with the same
words.
"""

from __future__ import annotations

from typing import Annotated, Any, Final

from fastapi import Depends, Request
from starlette.datastructures import Headers
from starlette.requests import HTTPConnection

from server.api.anonymous.visit_scope import admitted
from server.api.tower import address_of, tower_of
from server.domain.access import (
    AccessRequest,
    Action,
    BadToken,
    NotSignedIn,
    SessionExpired,
    judge,
)
from server.domain.people import Principal
from server.domain.refusal import Refusal

COOKIE: Final = "tower_session"


def token_in(headers: Headers) -> str | None:
    """The text behind `Authorization: Bearer`, or None where there is no such header."""
    scheme, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else None


async def authenticate(connection: HTTPConnection) -> Principal | NotSignedIn | SessionExpired | BadToken:
    """Who sent this request or opens this WebSocket. Does not raise the refusal."""
    tower = tower_of(connection)
    token = token_in(connection.headers)
    found: Principal | BadToken | SessionExpired
    if token is not None:
        found = await tower.tokens.find(token, tower.clock(), address=address_of(connection)) or BadToken()
    else:
        cookie = connection.cookies.get(COOKIE)
        if not cookie:
            return NotSignedIn()
        found = await tower.sessions.find(cookie, tower.clock()) or SessionExpired()
    if not isinstance(found, Refusal):
        admitted(connection)
    return found


async def admit(request: Request, action: Action) -> Principal:
    """The principal of the request, if it may do that now. Ask again where a body was waited for: who sent the
    beginning of it may have lost their right since. Raises the refusal."""
    found = await authenticate(request)
    if isinstance(found, Refusal):
        raise found
    verdict = judge(AccessRequest(found, action, now=tower_of(request).clock()))
    if verdict.refusal is not None:
        raise verdict.refusal
    return found


def who_may(action: Action) -> Any:
    """A route's dependency: the principal of the request, if it may do that."""

    async def checked(request: Request) -> Principal:
        return await admit(request, action)

    checked.action = action  # type: ignore[attr-defined]  # for the test that walks all routes
    return Depends(checked)


Anybody = Annotated[Principal, who_may(Action.KNOW_ONESELF)]
"""Whoever is signed in, however."""
Viewer = Annotated[Principal, who_may(Action.SEE_SQUAD)]
Pilot = Annotated[Principal, who_may(Action.FLY)]
Commander = Annotated[Principal, who_may(Action.COMMAND)]
Admin = Annotated[Principal, who_may(Action.ADMINISTER)]
TeamEditor = Annotated[Principal, who_may(Action.MANAGE_TEAMS)]
MetricsReader = Annotated[Principal, who_may(Action.READ_METRICS)]
InPerson = Annotated[Principal, who_may(Action.SEE_CREDENTIALS)]
Oneself = Annotated[Principal, who_may(Action.CHANGE_PREFERENCES)]
"""Whoever is signed in, in person."""
Prover = Annotated[Principal, who_may(Action.PROVE_ONESELF)]
"""Whoever may confirm that it is them: in person, before anything else that is asked of an account."""
Proved = Annotated[Principal, who_may(Action.CHANGE_CREDENTIALS)]
"""Whoever is signed in, in person, and proved who they are a moment ago."""
FactorSetter = Annotated[Principal, who_may(Action.SET_UP_SECOND_FACTOR)]
PasswordChanger = Annotated[Principal, who_may(Action.CHANGE_PASSWORD)]
ProvedAdmin = Annotated[Principal, who_may(Action.CHANGE_USERS)]
"""An admin in person, who proved who they are a moment ago."""
