"""`/api/v1/drones/{id}/video`: one viewer's WebSocket. A thin layer: units are written directly, without a task."""

import asyncio
import time
from typing import Final

from starlette.websockets import WebSocket

from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.link.api.session_watch import watch_session
from server.link.api.side_by_side import Ending, close_quietly, is_breach, until_one_ends
from server.link.api.viewer_sign_in import StillSignedIn
from server.link.api.websocket.direct_websocket import direct_writer
from server.link.core.flood_gate import FLOODING, PATIENCE, PATIENCE_PER_S
from server.link.core.socket_bounds import TOO_MANY_SOCKETS
from server.link.core.token_bucket import TokenBucket
from server.live.hub import SESSION_ENDED, Hub
from server.runtime.aligned_timers import SharedChecks
from server.video.core.streams import StreamKey
from server.video.core.viewer import VideoViewer
from server.video.core.viewer_messages import (
    MAX_REQUEST_BYTES,
    AskClock,
    ClockMessage,
    Drawn,
    MalformedVideoRequest,
    decode_video_request,
    stream_named,
)
from server.video.core.watching import why_not_watch
from wire.drops import DropReason
from wire.ids import DroneId

BAD_REQUEST: Final = 4400
LOSS_PROBE_EVERY_S: Final = 0.025
MAX_WAKEUPS: Final = 20
"""In a row: a unit that has not arrived by then is not delayed by a lost packet."""


class ViewerChannel:
    """One viewer's channel, from the accepted upgrade to its end."""

    def __init__(
        self,
        websocket: WebSocket,
        hub: Hub,
        principal: Principal,
        drone_id: DroneId,
        key: StreamKey,
        *,
        clock: Clock,
        shared_checks: SharedChecks,
        still_signed_in: StillSignedIn,
    ) -> None:
        self._websocket = websocket
        self._hub = hub
        self._clock = clock
        self._shared_checks = shared_checks
        self._still_signed_in = still_signed_in
        self._ending = Ending()
        now = time.monotonic()
        self._patience = TokenBucket(PATIENCE_PER_S, PATIENCE, now)
        self._probing: asyncio.TimerHandle | None = None
        self._probes = 0
        self._writer = writer = direct_writer(websocket)
        self._viewer = VideoViewer(
            hub.video.next_number(),
            principal,
            drone_id,
            key,
            now,
            write=writer.write_whole,
            send_text=writer.write_text,
            has_room=writer.has_room,
            close=self._ending.request,
            held_up=self._held_up,
            address=websocket.client.host if websocket.client else "",
        )

    async def run(self, subprotocol: str | None) -> None:
        """Runs until the viewer disconnects, or may no longer watch."""
        viewer, hub, writer = self._viewer, self._hub, self._writer
        await self._websocket.accept(subprotocol=subprotocol)
        writer.take_messages(largest_bytes=MAX_REQUEST_BYTES)
        # No await from here until it has entered: neither rights nor capacity can change in between.
        now = time.monotonic()
        no_room = hub.video_capacity_refusal(viewer.viewer.user_id, viewer.address, now)
        refusal = why_not_watch(hub.state.drones.get(viewer.drone_id), viewer.viewer)
        if refusal is not None:
            self._ending.request(refusal.code, refusal.words)
        elif no_room is not None:
            self._ending.request(TOO_MANY_SOCKETS, no_room)
        else:
            writer.on_room, writer.on_full = self._room, self._full
            writer.set_listeners(on_text=self._heard)
            hub.video.enter(viewer, now)
            try:
                await until_one_ends(self._receive(), self._watch_session(), self._ending.wait())
            finally:
                writer.on_room = writer.on_full = _nothing
                viewer.ended = True
                if self._probing is not None:
                    self._probing.cancel()
                hub.video.leave(viewer)
        if self._ending.requested:
            hub.video.traffic.closes[self._ending.code] += 1
            await close_quietly(self._websocket, self._ending.code, self._ending.why)

    def _room(self) -> None:
        self._hub.video.has_room(self._viewer, time.monotonic())

    def _full(self) -> None:
        self._hub.video.is_full(self._viewer)

    def _held_up(self) -> None:
        if self._probing is None and self._probes < MAX_WAKEUPS:
            self._probing = asyncio.get_running_loop().call_later(LOSS_PROBE_EVERY_S, self._probe_for_loss)

    def _probe_for_loss(self) -> None:
        """Sends small pings while a picture is overdue, so that TCP detects lost packets sooner."""
        self._probing, viewer = None, self._viewer
        self._hub.video.has_room(viewer, time.monotonic())
        if not viewer.ended and viewer.lockstep is None and viewer.pace.is_held_up:
            self._probes += 1
            self._writer.write_ping()

    async def _receive(self) -> None:
        try:
            while not self._ending.requested:
                message = await self._websocket.receive()
                if message["type"] == "websocket.disconnect":
                    self._hub.state.drops[DropReason.MALFORMED] += is_breach(message.get("code", 0))
                    return
                text = message.get("text")
                if text is None:
                    self._not_understood("viewers of video send text only")
                else:
                    self._heard(text.encode())
        except RuntimeError:
            return

    def _heard(self, text: bytes) -> None:
        viewer, now = self._viewer, time.monotonic()
        if viewer.ended:
            return
        if not viewer.requests.take(1.0, now):
            self._hub.state.drops[DropReason.FLOOD] += 1
            if not self._patience.take(1.0, now):
                self._hub.video.end(viewer, FLOODING, "too much was sent for too long")
            return
        try:
            request = decode_video_request(text)
        except MalformedVideoRequest as error:
            self._not_understood(str(error))
            return
        if isinstance(request, Drawn):
            self._probes = 0
            self._hub.video.got(viewer, request, now)
        elif isinstance(request, AskClock):
            viewer.notify(ClockMessage(request.sent, round(now * 1e6)))
        else:
            self._hub.video.want(viewer, stream_named(request.quality, request.codec), now)

    def _not_understood(self, why: str) -> None:
        self._hub.state.drops[DropReason.MALFORMED] += 1
        self._hub.video.end(self._viewer, BAD_REQUEST, why)

    async def _watch_session(self) -> None:
        await watch_session(
            self._viewer.viewer,
            clock=self._clock,
            shared_checks=self._shared_checks,
            still_signed_in=self._still_signed_in,
            over=self._session_over,
        )

    def _session_over(self, why: str) -> None:
        self._hub.end_sessions([self._viewer.viewer.session_id], why)
        self._ending.request(SESSION_ENDED, why)


def _nothing() -> None:
    pass
