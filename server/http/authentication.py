"""Finds out who sends a request or opens a WebSocket, and whether they may do what they ask for.

There are two ways to sign in: a browser's session cookie, which allows all that its user may do, and an API token in
the `Authorization` header, which allows what both its scopes and its owner's role allow. If a request carries a token,
its cookie is ignored.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from starlette.datastructures import Headers
from starlette.requests import HTTPConnection

from server.accounts.store.sessions import Sessions
from server.accounts.store.tokens import ApiTokens
from server.anonymous.api.anonymous_scope import admitted
from server.http.peer_address import address_of
from server.http.remembered import RememberedSignIns
from server.http.request_cost import pays
from server.http.request_shares import RequestShares
from server.kernel.access import AccessRequest, Action, BadToken, NotSignedIn, SessionExpired, judge
from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.kernel.refusal import Refusal
from server.storage.database import Database, DatabaseUnavailable
from server.storage.writer_turns import write_as

COOKIE: Final = "tower_session"
VOUCHED: Final = "tower.vouched"
"""Of a request that came over the bus: its sender as the other tower remembers them, and the revision of the fleet."""


def token_in(headers: Headers) -> str | None:
    """Returns the text behind `Authorization: Bearer`, or None if there is no such header."""
    scheme, _, token = headers.get("authorization", "").partition(" ")
    return token.strip() if scheme.lower() == "bearer" else None


class Authenticator:
    """One instance per tower."""

    def __init__(
        self,
        sessions: Sessions,
        api_tokens: ApiTokens,
        clock: Clock,
        *,
        database: Database,
        remembered: RememberedSignIns,
        revision: Callable[[], int],
        requests: RequestShares,
    ) -> None:
        self.requests = requests
        self._sessions = sessions
        self._api_tokens = api_tokens
        self._clock = clock
        self._database = database
        self._remembered = remembered
        self._revision = revision

    async def authenticate(self, connection: HTTPConnection) -> Principal | NotSignedIn | SessionExpired | BadToken:
        """Returns who sent this request or opens this WebSocket; returns a refusal instead of raising it. While the
        database does not respond, a sign-in that it confirmed before counts (`remembered.py`); raises
        DatabaseUnavailable for any other."""
        secret = _secret_of(connection)
        if not secret:
            return NotSignedIn() if token_in(connection.headers) is None else BadToken()
        try:
            revision = self._revision()
            found = await self._database.in_time(self._find(connection, secret))
            self._remembered.note(secret, found, revision)
        except DatabaseUnavailable:
            found = self.remembered(connection)
            if found is None:
                raise
        if found is None:
            return SessionExpired() if token_in(connection.headers) is None else BadToken()
        admitted(connection)
        write_as(found.user_id)
        return found

    def remembered(self, connection: HTTPConnection) -> Principal | None:
        """Returns who sent this request, as far as is known without the database."""
        secret, now = _secret_of(connection), self._clock()
        if not secret:
            return None
        vouched: tuple[Principal, int] | None = connection.scope.get(VOUCHED)
        found = self._remembered.find(secret, now)
        return self._remembered.vouched(*vouched, now) if found is None and vouched is not None else found

    def vouch(self, connection: HTTPConnection) -> tuple[Principal, int] | None:
        """Returns who sent this request as far as is known without the database, and the revision of the fleet at
        which the database confirmed it: for another tower that carries the request out."""
        secret = _secret_of(connection)
        return self._remembered.vouch(secret, self._clock()) if secret else None

    async def _find(self, connection: HTTPConnection, secret: str) -> Principal | None:
        if token_in(connection.headers) is not None:
            return await self._api_tokens.find(secret, self._clock(), address=address_of(connection))
        return await self._sessions.find(secret, self._clock())

    async def admit(self, connection: HTTPConnection, action: Action) -> Principal:
        """Returns the principal of the request, if it may do that now and has not asked too much; raises the refusal
        otherwise. Call it again after waiting for a body: the sender may have lost the right meanwhile."""
        found = await self.authenticate(connection)
        if isinstance(found, Refusal):
            raise found
        verdict = judge(AccessRequest(found, action, now=self._clock()))
        if verdict.refusal is not None:
            raise verdict.refusal
        if self.requests.admit(found.user_id, action, connection.scope.get("method", "GET")):
            pays(connection, found.user_id)
        return found


def _secret_of(connection: HTTPConnection) -> str | None:
    token = token_in(connection.headers)
    return connection.cookies.get(COOKIE) if token is None else token
