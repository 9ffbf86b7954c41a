"""The two WebSocket doors of the relay: `/api/v1/live` for browsers, `/api/v1/agent` for agents."""

from typing import Final

from fastapi import APIRouter
from starlette.websockets import WebSocket

from server.api.relay.agent_channel import AgentChannel
from server.api.relay.live_channel import BROWSER_SUBPROTOCOL, LiveChannel
from server.api.relay.viewer_sign_in import StillSignedIn, sign_in_viewer, turn_away
from server.api.tower import tower_of
from server.domain.access import AccessRequest, Action, judge

NOT_FOR_WATCHING: Final = 4403

router = APIRouter()


@router.websocket("/api/v1/live")
async def live(websocket: WebSocket) -> None:
    """Frames and events for one signed-in browser, or a program with a token.

    `?scopes=watch` asks for less than the sign-in allows: nothing that flies, and nobody whose presence counts.
    """
    tower = tower_of(websocket)
    subprotocol = BROWSER_SUBPROTOCOL if BROWSER_SUBPROTOCOL in websocket.scope["subprotocols"] else None
    revision = tower.hub.fleet_revision
    viewer = await sign_in_viewer(websocket, subprotocol)
    if viewer is None:
        return
    verdict = judge(AccessRequest(viewer, Action.SEE_SQUAD))
    if verdict.refusal is not None:
        await turn_away(websocket, subprotocol, NOT_FOR_WATCHING, verdict.refusal.message)
        return
    channel = LiveChannel(
        websocket,
        tower.hub,
        viewer,
        clock=tower.clock,
        looks=tower.looks,
        subprotocol=subprotocol,
        still_signed_in=StillSignedIn(tower, viewer, revision=revision),
        write_round=websocket.app.state.data_endpoint.write_round,
    )
    await channel.run()


@router.websocket("/api/v1/agent")
async def agent(websocket: WebSocket) -> None:
    """The control channel of one agent."""
    tower = tower_of(websocket)
    endpoint = websocket.app.state.data_endpoint
    channel = AgentChannel(
        websocket, tower.hub, endpoint, tower.clock, rules=tower.sign_in_rules, anonymous=tower.anonymous
    )
    await channel.run()
