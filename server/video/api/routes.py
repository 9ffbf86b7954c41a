"""Video: two WebSockets, and a route for the state of the video."""

from __future__ import annotations

import time
from typing import Annotated, Final

from fastapi import APIRouter, Path
from starlette.websockets import WebSocket

from server.http.access import Viewer
from server.http.dependencies import AnonymousBudgetDep, ClockDep, HubDep, SharedChecksDep
from server.http.problem_docs import answers
from server.kernel.access import UnknownDrone
from server.link.api.viewer_sign_in import ViewerSignInDep, refuse_connection
from server.operations.core.refusals import ViewTaken
from server.video.api.agent_channel import AgentVideoSocket
from server.video.api.viewer_channel import BAD_REQUEST, ViewerChannel
from server.video.core.viewer_messages import MalformedVideoRequest, streams_named
from server.video.core.views import VideoView, view_of
from server.video.core.watching import why_not_watch
from wire.ids import DroneId
from wire.video import VIEWER_VIDEO_SUBPROTOCOL

router = APIRouter(tags=["video"])

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
_NO_DRONE: Final = DroneId(0)


@router.websocket("/api/v1/agent/video")
async def agent_video(websocket: WebSocket, hub: HubDep, anonymous: AnonymousBudgetDep) -> None:
    """The video units of one agent."""
    await AgentVideoSocket(websocket, hub, anonymous).run()


@router.websocket("/api/v1/drones/{drone_id}/video")
async def watch_video(
    websocket: WebSocket,
    viewer_sign_in: ViewerSignInDep,
    hub: HubDep,
    clock: ClockDep,
    shared_checks: SharedChecksDep,
    drone_id: str,
) -> None:
    """Video units and states for one viewer. `?quality=low|medium|high&codec=mpeg1|h264`, or several codecs, the best
    first: the tower uses the first that the agent offers, or the last."""
    offered = websocket.scope["subprotocols"]
    subprotocol = VIEWER_VIDEO_SUBPROTOCOL if VIEWER_VIDEO_SUBPROTOCOL in offered else None
    viewer = await viewer_sign_in.sign_in(websocket, subprotocol)
    if viewer is None:
        return
    number = DroneId(int(drone_id)) if drone_id.isascii() and drone_id.isdigit() and len(drone_id) < 11 else _NO_DRONE
    refusal = why_not_watch(hub.state.drones.get(number), viewer)
    if refusal is not None:
        await refuse_connection(websocket, subprotocol, refusal.code, refusal.words)
        return
    try:
        keys = streams_named(_said(websocket, "quality", "medium"), _said(websocket, "codec", "mpeg1"))
    except MalformedVideoRequest as error:
        await refuse_connection(websocket, subprotocol, BAD_REQUEST, str(error))
        return
    key = hub.video.first_offered(number, keys)
    channel = ViewerChannel(
        websocket,
        hub,
        viewer,
        number,
        key,
        clock=clock,
        shared_checks=shared_checks,
        still_signed_in=viewer_sign_in.still_signed_in(viewer),
    )
    await channel.run(subprotocol)


def _said(websocket: WebSocket, name: str, otherwise: str) -> str:
    """Returns the query parameter `name`. Raises MalformedVideoRequest if it occurs twice."""
    said = websocket.query_params.getlist(name)
    if len(said) > 1:
        raise MalformedVideoRequest(f"{name} must be said once")
    return said[0] if said else otherwise


@router.get("/api/v1/drones/{drone_id}/video", responses=answers(UnknownDrone, ViewTaken))
async def get_video(principal: Viewer, hub: HubDep, drone_id: DronePath) -> VideoView:
    """Returns the state of a drone's video, and which streams its agent is asked for."""
    now = time.monotonic()
    drone = hub.squads.drone(DroneId(drone_id), principal.user_id, principal.role)
    if drone is None:
        raise UnknownDrone
    if drone.no_video_user_id == principal.user_id:
        raise ViewTaken(drone.record.name)
    return view_of(hub.video.video_of(drone, now), now)
