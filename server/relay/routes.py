"""The two WebSocket doors of the relay: `/api/v1/live` for browsers, `/api/v1/agent` for agents."""

from typing import Final

from fastapi import APIRouter
from starlette.websockets import WebSocket

from server.access import authenticate
from server.origin import origin_allowed
from server.refusal import Refusal
from server.relay.agent_channel import AgentChannel
from server.relay.live_channel import BROWSER_SUBPROTOCOL, LiveChannel
from server.tower import tower_of

NOT_SIGNED_IN: Final = 4401
WRONG_ORIGIN: Final = 4403

router = APIRouter()


@router.websocket("/api/v1/live")
async def live(websocket: WebSocket) -> None:
    """Frames and events for one signed-in browser."""
    tower = tower_of(websocket)
    subprotocol = BROWSER_SUBPROTOCOL if BROWSER_SUBPROTOCOL in websocket.scope["subprotocols"] else None
    if not origin_allowed(websocket, tower.settings):
        # A browser shows a script no more of a refused upgrade than that it failed, so the code comes after one.
        await websocket.accept(subprotocol=subprotocol)
        await websocket.close(WRONG_ORIGIN, "this page may not talk to this tower")
        return
    viewer = await authenticate(websocket)
    if isinstance(viewer, Refusal):
        await websocket.accept(subprotocol=subprotocol)
        await websocket.close(NOT_SIGNED_IN, viewer.message)
        return
    session_id = viewer.session_id
    channel = LiveChannel(
        websocket,
        tower.hub,
        viewer,
        clock=tower.clock,
        subprotocol=subprotocol,
        still_signed_in=lambda now: tower.sessions.touch(session_id, now),
    )
    await channel.run()


@router.websocket("/api/v1/agent")
async def agent(websocket: WebSocket) -> None:
    """The control channel of one agent."""
    await AgentChannel(websocket, tower_of(websocket).hub, websocket.app.state.data_endpoint).run()
