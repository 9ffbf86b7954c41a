"""How whoever watches signs in on a WebSocket: a session cookie from a page of ours, or a token. One way for all."""

from collections.abc import Awaitable, Callable
from datetime import datetime
from typing import Final

from starlette.websockets import WebSocket

from server.access import authenticate, token_in
from server.accounts.scopes import ALL_SCOPES, Scope
from server.accounts.sessions import Principal, SignInId, TokenId
from server.origin import origin_allowed
from server.refusal import Refusal
from server.tower import Tower, tower_of

NOT_SIGNED_IN: Final = 4401
WRONG_ORIGIN: Final = 4403

StillSignedIn = Callable[[datetime], Awaitable[Principal | None]]
"""Asks the database whether the sign-in still stands; called about once a minute, off the frame path."""


async def sign_in_viewer(websocket: WebSocket, subprotocol: str | None) -> Principal | None:
    """Who opens this. None: nobody who may; the connection has been closed with a code that says why.

    `?scopes=watch` asks for less than the sign-in allows.
    """
    tower = tower_of(websocket)
    if token_in(websocket.headers) is None and not origin_allowed(websocket, tower.settings):
        await turn_away(websocket, subprotocol, WRONG_ORIGIN, "this page may not talk to this tower")
        return None
    viewer = await authenticate(websocket)
    if isinstance(viewer, Refusal):
        await turn_away(websocket, subprotocol, NOT_SIGNED_IN, viewer.message)
        return None
    return viewer.narrowed(_scopes_wanted(websocket))


async def turn_away(websocket: WebSocket, subprotocol: str | None, code: int, why: str) -> None:
    """A browser shows a script no more of a refused upgrade than that it failed, so the code comes after one."""
    await websocket.accept(subprotocol=subprotocol)
    await websocket.close(code, why)


def still_signed_in(tower: Tower, signed_in_by: SignInId) -> StillSignedIn:
    """For a connection that stays open."""

    async def ask(now: datetime) -> Principal | None:
        if isinstance(signed_in_by, TokenId):
            return await tower.tokens.touch(signed_in_by, now)
        return await tower.sessions.touch(signed_in_by, now)

    return ask


def _scopes_wanted(websocket: WebSocket) -> frozenset[Scope]:
    """All that there are, unless the address names some."""
    named = websocket.query_params.get("scopes")
    return ALL_SCOPES if named is None else frozenset(scope for scope in Scope if scope.value in named.split(","))
