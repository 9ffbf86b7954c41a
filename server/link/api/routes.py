"""The two WebSockets of the relay: `/api/v1/live` for browsers, `/api/v1/agent` for agents."""

from typing import Final

from fastapi import APIRouter
from starlette.websockets import WebSocket

from server.http.dependencies import (
    AnonymousBudgetDep,
    ClockDep,
    DataEndpointDep,
    HubDep,
    SharedChecksDep,
    SignInRulesDep,
)
from server.kernel.access import AccessRequest, Action, judge
from server.link.api.agent_channel import AgentChannel
from server.link.api.live_channel import BROWSER_SUBPROTOCOL, LiveChannel
from server.link.api.viewer_sign_in import TRY_AGAIN, ViewerSignInDep, refuse_connection

NOT_FOR_WATCHING: Final = 4403

router = APIRouter()


@router.websocket("/api/v1/live")
async def live(
    websocket: WebSocket,
    viewer_sign_in: ViewerSignInDep,
    hub: HubDep,
    clock: ClockDep,
    shared_checks: SharedChecksDep,
    endpoint: DataEndpointDep,
) -> None:
    """Frames and events for one signed-in browser, or a program with a token.

    `?scopes=watch` narrows the rights of the connection: it cannot fly, and its presence does not count.
    """
    subprotocol = BROWSER_SUBPROTOCOL if BROWSER_SUBPROTOCOL in websocket.scope["subprotocols"] else None
    if not hub.takes_browsers:
        await refuse_connection(websocket, subprotocol, TRY_AGAIN, "this tower ends its work: connect to another one")
        return
    viewer = await viewer_sign_in.sign_in(websocket, subprotocol)
    if viewer is None:
        return
    verdict = judge(AccessRequest(viewer, Action.SEE_SQUAD))
    if verdict.refusal is not None:
        await refuse_connection(websocket, subprotocol, NOT_FOR_WATCHING, verdict.refusal.message)
        return
    channel = LiveChannel(
        websocket,
        hub,
        viewer,
        clock=clock,
        shared_checks=shared_checks,
        subprotocol=subprotocol,
        still_signed_in=viewer_sign_in.still_signed_in(viewer),
        write_round=endpoint.write_round,
    )
    await channel.run()


@router.websocket("/api/v1/agent")
async def agent(
    websocket: WebSocket,
    hub: HubDep,
    endpoint: DataEndpointDep,
    clock: ClockDep,
    rules: SignInRulesDep,
    anonymous: AnonymousBudgetDep,
) -> None:
    """The control channel of one agent."""
    await AgentChannel(websocket, hub, endpoint, clock, rules=rules, anonymous=anonymous).run()
