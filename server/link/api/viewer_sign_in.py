"""How viewers sign in on a WebSocket: with a session cookie from a page of ours, or with a token."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Final

from fastapi import Depends
from starlette.websockets import WebSocket

from server.accounts.store.sessions import Sessions
from server.accounts.store.tokens import ApiTokens
from server.http.authentication import Authenticator, token_in
from server.http.dependencies import ApiTokensDep, AuthenticatorDep, HubDep, SessionsDep, SettingsDep
from server.http.origin import origin_allowed
from server.kernel.access import AccessRequest, Action, judge
from server.kernel.people import Principal, TokenId
from server.kernel.refusal import Refusal
from server.kernel.scopes import ALL_SCOPES, Scope
from server.live.fleet_changes import role_changed
from server.live.hub import Hub
from server.runtime.settings import Settings
from server.storage.database import DatabaseUnavailable

TRY_AGAIN: Final = 1013
NOT_SIGNED_IN: Final = 4401
WRONG_ORIGIN: Final = 4403


@dataclass(frozen=True)
class ViewerSignIn:
    """One instance per connection. Create it before any lookup: it remembers the revision of the fleet."""

    authenticator: Authenticator
    sessions: Sessions
    api_tokens: ApiTokens
    hub: Hub
    settings: Settings
    revision: int
    """`hub.fleet.revision` before the lookup. Changes between then and the moment at which the hub has the connection
    would otherwise be missed."""

    async def sign_in(self, websocket: WebSocket, subprotocol: str | None) -> Principal | None:
        """Returns who opens this connection. None: refused; the connection has been closed with a code that says why.

        `?scopes=watch` requests less than the sign-in allows.
        """
        if token_in(websocket.headers) is None and not origin_allowed(websocket, self.settings):
            await refuse_connection(websocket, subprotocol, WRONG_ORIGIN, "this page may not talk to this tower")
            return None
        try:
            viewer = await self.authenticator.authenticate(websocket)
        except DatabaseUnavailable:
            await refuse_connection(websocket, subprotocol, TRY_AGAIN, "the database does not answer: try again")
            return None
        if isinstance(viewer, Refusal):
            await refuse_connection(websocket, subprotocol, NOT_SIGNED_IN, viewer.message)
            return None
        return viewer.narrowed(_scopes_wanted(websocket))

    def still_signed_in(self, viewer: Principal) -> StillSignedIn:
        """Starts watching the sign-in."""
        return StillSignedIn(self.hub, self.sessions, self.api_tokens, viewer, revision=self.revision)


async def _viewer_sign_in(
    authenticator: AuthenticatorDep,
    sessions: SessionsDep,
    api_tokens: ApiTokensDep,
    hub: HubDep,
    settings: SettingsDep,
) -> ViewerSignIn:
    return ViewerSignIn(authenticator, sessions, api_tokens, hub, settings, hub.fleet.revision)


ViewerSignInDep = Annotated[ViewerSignIn, Depends(_viewer_sign_in)]


async def refuse_connection(websocket: WebSocket, subprotocol: str | None, code: int, why: str) -> None:
    """Refuses after the upgrade: for a refused upgrade, a browser shows a script only that it failed, without a
    code."""
    await websocket.accept(subprotocol=subprotocol)
    await websocket.close(code, why)


class StillSignedIn:
    """Tells whether the sign-in of an open connection is still valid.

    `revision`: from ViewerSignIn.
    """

    def __init__(
        self, hub: Hub, sessions: Sessions, api_tokens: ApiTokens, viewer: Principal, *, revision: int
    ) -> None:
        self._hub = hub
        self._sessions = sessions
        self._api_tokens = api_tokens
        self._viewer = viewer
        self._revision = revision
        self._is_new = True

    def comes_into_doubt(self) -> bool:
        """Whether the fleet has changed since the last call, and the database must be asked. Call it once a second."""
        hub, is_new = self._hub, self._is_new
        changed = hub.fleet.revision != self._revision
        self._revision, self._is_new = hub.fleet.revision, False
        return changed and (is_new or not hub.fleet.knows_sign_in(self._viewer.session_id))

    async def ask(self, now: datetime) -> Principal | str:
        """Asks the database, off the frame path. Returns the reason as text if the connection must end."""
        signed_in_by = self._viewer.session_id
        if isinstance(signed_in_by, TokenId):
            found = await self._api_tokens.touch(signed_in_by, now)
        else:
            found = await self._sessions.touch(signed_in_by, now)
        if found is None:
            return "the session has ended"
        if found.role is not self._viewer.role:
            return role_changed(found.role)
        refusal = judge(AccessRequest(found, Action.SEE_SQUAD)).refusal
        return found if refusal is None else refusal.message


def _scopes_wanted(websocket: WebSocket) -> frozenset[Scope]:
    """Returns all scopes, unless the address names some."""
    named = websocket.query_params.get("scopes")
    return ALL_SCOPES if named is None else frozenset(scope for scope in Scope if scope.value in named.split(","))
