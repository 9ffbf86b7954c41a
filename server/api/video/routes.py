"""The doors of video: two WebSockets, and how it is for those who only ask."""

from __future__ import annotations

import time
from typing import Annotated, Final

from fastapi import APIRouter, Path, Request
from starlette.websockets import WebSocket

from server.api.access import Viewer
from server.api.http.problem_docs import answers
from server.api.relay.viewer_sign_in import StillSignedIn, sign_in_viewer, turn_away
from server.api.tower import tower_of
from server.api.video.agent_channel import AgentVideoSocket
from server.api.video.viewer_channel import BAD_REQUEST, ViewerChannel
from server.domain.access import UnknownDrone
from server.live.operations.refusals import ViewTaken
from server.live.video.viewer_messages import MalformedVideoRequest, streams_named
from server.live.video.views import VideoView, view_of
from server.live.video.watching import why_not_watch
from wire.ids import DroneId
from wire.video import VIEWER_VIDEO_SUBPROTOCOL

router = APIRouter(tags=["video"])

DronePath = Annotated[int, Path(ge=1, le=0xFFFFFFFF)]
_NO_DRONE: Final = DroneId(0)


@router.websocket("/api/v1/agent/video")
async def agent_video(websocket: WebSocket) -> None:
    """The units of one agent."""
    tower = tower_of(websocket)
    await AgentVideoSocket(websocket, tower.hub, tower.anonymous).run()


@router.websocket("/api/v1/drones/{drone_id}/video")
async def watch_video(websocket: WebSocket, drone_id: str) -> None:
    """Units and states for one viewer. `?quality=low|medium|high&codec=mpeg1|h264`, or several codecs, the best first:
    the first that the agent offers, or the last."""
    tower = tower_of(websocket)
    offered = websocket.scope["subprotocols"]
    subprotocol = VIEWER_VIDEO_SUBPROTOCOL if VIEWER_VIDEO_SUBPROTOCOL in offered else None
    revision = tower.hub.fleet_revision
    viewer = await sign_in_viewer(websocket, subprotocol)
    if viewer is None:
        return
    number = DroneId(int(drone_id)) if drone_id.isascii() and drone_id.isdigit() and len(drone_id) < 11 else _NO_DRONE
    refusal = why_not_watch(tower.hub.drone(number), viewer)
    if refusal is not None:
        await turn_away(websocket, subprotocol, refusal.code, refusal.words)
        return
    try:
        keys = streams_named(_said(websocket, "quality", "medium"), _said(websocket, "codec", "mpeg1"))
    except MalformedVideoRequest as error:
        await turn_away(websocket, subprotocol, BAD_REQUEST, str(error))
        return
    key = tower.hub.video.first_offered(number, keys)
    signed_in = StillSignedIn(tower, viewer, revision=revision)
    channel = ViewerChannel(
        websocket, tower.hub, viewer, number, key, clock=tower.clock, looks=tower.looks, still_signed_in=signed_in
    )
    await channel.run(subprotocol)


def _said(websocket: WebSocket, name: str, otherwise: str) -> str:
    """What the address says of `name`. Raises MalformedVideoRequest where it says two things."""
    said = websocket.query_params.getlist(name)
    if len(said) > 1:
        raise MalformedVideoRequest(f"{name} must be said once")
    return said[0] if said else otherwise


@router.get("/api/v1/drones/{drone_id}/video", responses=answers(UnknownDrone, ViewTaken))
async def get_video(request: Request, principal: Viewer, drone_id: DronePath) -> VideoView:
    """How it is with the video of a drone, and which streams its agent is asked for."""
    hub, now = tower_of(request).hub, time.monotonic()
    drone = hub.drone_for(DroneId(drone_id), principal.user_id, principal.role)
    if drone is None:
        raise UnknownDrone
    if drone.no_video_user_id == principal.user_id:
        raise ViewTaken(drone.record.name)
    return view_of(hub.video.video_of(drone, now), now)
