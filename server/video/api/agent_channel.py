"""`/api/v1/agent/video`: the video units of one agent. A thin layer: ticket, units in, acknowledgements out."""

import time
from typing import Final

import msgspec
import structlog
from starlette.responses import PlainTextResponse
from starlette.websockets import WebSocket

from server.anonymous.api.anonymous_scope import admitted
from server.anonymous.api.refusal_log import log_refusal
from server.anonymous.core.budget import AnonymousBudget
from server.http.private_path import is_private_path
from server.link.api.side_by_side import Ending, close_quietly, is_breach, until_one_ends
from server.link.api.websocket.direct_websocket import direct_writer
from server.link.core.flood_gate import FLOODING
from server.live.hub import Hub
from server.video.core.drone_video import DroneVideo
from server.video.core.streams import StreamKey
from wire.drops import DropReason
from wire.video import AGENT_VIDEO_SUBPROTOCOL, MAX_UNIT_BYTES, Got, KeyWanted, MalformedUnit, encode_got

BAD_MESSAGE: Final = 4400
SLICE_BYTES: Final = 16 * 1024
"""Most pictures are smaller than this, and are parsed at once."""

_log = structlog.get_logger(__name__)


class AgentVideoSocket:
    """The socket from the upgrade to its end. Implements the service's AgentVideoChannel."""

    def __init__(self, websocket: WebSocket, hub: Hub, anonymous: AnonymousBudget) -> None:
        self._websocket = websocket
        self._anonymous = anonymous
        self._hub = hub
        self._ending = Ending()

    async def run(self) -> None:
        """Runs until either side ends the connection."""
        if not is_private_path(self._websocket):
            await self._deny(403, "agents must use https: a ticket must not cross the network in the clear")
            return
        scheme, _, ticket = self._websocket.headers.get("authorization", "").partition(" ")
        video = self._hub.video.drone_of_ticket(ticket.strip()) if scheme.lower() == "bearer" else None
        if video is None:
            await self._deny(401, "unknown ticket")
            return
        admitted(self._websocket)
        offered = self._websocket.scope["subprotocols"]
        subprotocol = AGENT_VIDEO_SUBPROTOCOL if AGENT_VIDEO_SUBPROTOCOL in offered else None
        await self._websocket.accept(subprotocol=subprotocol)
        self._writer = direct_writer(self._websocket)
        self._writer.take_messages(largest_bytes=MAX_UNIT_BYTES, slice_bytes=SLICE_BYTES)
        # No await since `drone_of_ticket` except the handshake, during which the link may have ended.
        if self._hub.video.drone_of_ticket(ticket.strip()) is not video:
            await close_quietly(self._websocket, 4401, "the agent's link has ended")
            return
        log = _log.bind(drone=video.name)
        log.info("agent_video_up")
        self._hub.video.open_channel(video, self)
        self._writer.set_listeners(on_binary=lambda unit: self._unit(video, unit))
        try:
            await until_one_ends(self._receive(video), self._ending.wait())
        finally:
            self._hub.video.channel_lost(video, self)
            log.info("agent_video_down", why=self._ending.why)
        if self._ending.requested:
            await close_quietly(self._websocket, self._ending.code, self._ending.why)

    def ask_key(self, key: StreamKey) -> None:
        """See AgentVideoChannel. Skips an agent that does not read."""
        if self._writer.has_room():
            self._writer.write_text(msgspec.json.encode(KeyWanted(key.quality, key.codec)))

    def close(self, code: int, why: str) -> None:
        """See AgentVideoChannel."""
        self._ending.request(code, why)

    async def _deny(self, status: int, words: str) -> None:
        log_refusal(self._anonymous, "agent_video_refused", status, words)
        headers = {"WWW-Authenticate": "Bearer"} if status == 401 else None
        await self._websocket.send_denial_response(PlainTextResponse(words, status_code=status, headers=headers))

    async def _receive(self, video: DroneVideo) -> None:
        while not self._ending.requested:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                self._hub.state.drops[DropReason.MALFORMED] += is_breach(message.get("code", 0))
                return
            unit = message.get("bytes")
            if unit is None:
                self._hub.state.drops[DropReason.MALFORMED] += 1
                self._ending.request(BAD_MESSAGE, "not a message of this channel")
            else:
                self._unit(video, unit)

    def _unit(self, video: DroneVideo, unit: bytes) -> None:
        if self._ending.requested:
            return
        drops, now = self._hub.state.drops, time.monotonic()
        if not video.may_send(len(unit), now):
            drops[DropReason.FLOOD] += 1
            self._ending.request(FLOODING, "more video was sent than any camera produces")
            return
        try:
            head = self._hub.video.unit(video, self, unit, now)
        except MalformedUnit as error:
            drops[DropReason.MALFORMED] += 1
            self._ending.request(BAD_MESSAGE, str(error))
            return
        # An agent that does not read its acknowledgements detects the blocked path by their absence.
        if self._writer.has_room():
            self._writer.write_binary(encode_got(Got(head.quality, head.codec, head.sequence)))
