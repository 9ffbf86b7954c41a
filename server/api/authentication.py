"""Finds out who sends a request or opens a WebSocket, and whether they may do what they ask for.

Two ways to sign in: a browser's session cookie, for everything that its user may do, and an API token in the
`Authorization` header, for what its scopes say and its owner may do. Where a token comes with a request, no cookie of
it is looked at.
"""

from __future__ import annotations

from typing import Final

from starlette.datastructures import Headers
from starlette.requests import HTTPConnection

from server.api.anonymous.visit_scope import admitted
from server.api.http.peer_address import address_of
from server.domain.access import AccessRequest, Action, BadToken, NotSignedIn, SessionExpired, judge
from server.domain.clock import Clock
from server.domain.people import Principal
from server.domain.refusal import Refusal
from server.store.accounts.sessions import Sessions
from server.store.accounts.tokens import ApiTokens

COOKIE: Final = "tower_session"


def token_in(headers: Headers) -> str | None:
    """The text behind `Authorization: Bearer`, or None where there is no such header."""
    scheme, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else None


class Authenticator:
    """One for a tower."""

    def __init__(self, sessions: Sessions, api_tokens: ApiTokens, clock: Clock) -> None:
        self._sessions = sessions
        self._api_tokens = api_tokens
        self._clock = clock

    async def authenticate(self, connection: HTTPConnection) -> Principal | NotSignedIn | SessionExpired | BadToken:
        """Who sent this request or opens this WebSocket. Does not raise the refusal."""
        token = token_in(connection.headers)
        found: Principal | BadToken | SessionExpired
        if token is not None:
            address = address_of(connection)
            found = await self._api_tokens.find(token, self._clock(), address=address) or BadToken()
        else:
            cookie = connection.cookies.get(COOKIE)
            if not cookie:
                return NotSignedIn()
            found = await self._sessions.find(cookie, self._clock()) or SessionExpired()
        if not isinstance(found, Refusal):
            admitted(connection)
        return found

    async def admit(self, connection: HTTPConnection, action: Action) -> Principal:
        """The principal of the request, if it may do that now. Ask again where a body was waited for: who sent the
        beginning of it may have lost their right since. Raises the refusal."""
        found = await self.authenticate(connection)
        if isinstance(found, Refusal):
            raise found
        verdict = judge(AccessRequest(found, action, now=self._clock()))
        if verdict.refusal is not None:
            raise verdict.refusal
        return found
