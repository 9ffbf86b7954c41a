"""The two WebSocket doors of the relay: `/api/v1/live` for browsers, `/api/v1/agent` for agents."""

from datetime import datetime
from typing import Final

from fastapi import APIRouter
from starlette.websockets import WebSocket

from server.access import AccessRequest, Action, authenticate, judge, token_in
from server.accounts.scopes import ALL_SCOPES, Scope
from server.accounts.sessions import Principal, SignInId, TokenId
from server.origin import origin_allowed
from server.refusal import Refusal
from server.relay.agent_channel import AgentChannel
from server.relay.live_channel import BROWSER_SUBPROTOCOL, LiveChannel
from server.tower import Tower, tower_of

NOT_SIGNED_IN: Final = 4401
WRONG_ORIGIN: Final = 4403
NOT_FOR_WATCHING: Final = 4403

router = APIRouter()


@router.websocket("/api/v1/live")
async def live(websocket: WebSocket) -> None:
    """Frames and events for one signed-in browser, or a program with a token.

    `?scopes=watch` asks for less than the sign-in allows: nothing that flies, and nobody whose presence counts.
    """
    tower = tower_of(websocket)
    subprotocol = BROWSER_SUBPROTOCOL if BROWSER_SUBPROTOCOL in websocket.scope["subprotocols"] else None
    if token_in(websocket.headers) is None and not origin_allowed(websocket, tower.settings):
        # A browser shows a script no more of a refused upgrade than that it failed, so the code comes after one.
        await websocket.accept(subprotocol=subprotocol)
        await websocket.close(WRONG_ORIGIN, "this page may not talk to this tower")
        return
    viewer = await authenticate(websocket)
    if isinstance(viewer, Refusal):
        await websocket.accept(subprotocol=subprotocol)
        await websocket.close(NOT_SIGNED_IN, viewer.message)
        return
    viewer = viewer.narrowed(_scopes_wanted(websocket))
    verdict = judge(AccessRequest(viewer, Action.SEE_SQUAD))
    if verdict.refusal is not None:
        await websocket.accept(subprotocol=subprotocol)
        await websocket.close(NOT_FOR_WATCHING, verdict.refusal.message)
        return
    channel = LiveChannel(
        websocket,
        tower.hub,
        viewer,
        clock=tower.clock,
        subprotocol=subprotocol,
        still_signed_in=lambda now: _still_signed_in(tower, viewer.session_id, now),
        write_round=websocket.app.state.data_endpoint.write_round,
    )
    await channel.run()


def _scopes_wanted(websocket: WebSocket) -> frozenset[Scope]:
    """All that there are, unless the address names some."""
    named = websocket.query_params.get("scopes")
    return ALL_SCOPES if named is None else frozenset(scope for scope in Scope if scope.value in named.split(","))


async def _still_signed_in(tower: Tower, signed_in_by: SignInId, now: datetime) -> Principal | None:
    if isinstance(signed_in_by, TokenId):
        return await tower.tokens.touch(signed_in_by, now)
    return await tower.sessions.touch(signed_in_by, now)


@router.websocket("/api/v1/agent")
async def agent(websocket: WebSocket) -> None:
    """The control channel of one agent."""
    tower = tower_of(websocket)
    await AgentChannel(websocket, tower.hub, websocket.app.state.data_endpoint, tower.clock).run()
