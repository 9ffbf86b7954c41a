"""`/api/v1/live`: the WebSocket of one browser. A thin layer: reads its messages, writes what its outbox has due."""

import time
from typing import Final

from starlette.websockets import WebSocket

from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.link.api.live_writer import LiveWriter
from server.link.api.session_watch import watch_session
from server.link.api.side_by_side import Ending, close_quietly, is_breach, until_one_ends
from server.link.api.viewer_sign_in import StillSignedIn
from server.link.api.websocket.direct_websocket import direct_writer
from server.link.api.write_round import WriteRound
from server.link.core.socket_bounds import TOO_MANY_SOCKETS
from server.link.core.viewport import Viewport
from server.live.browser import Browser
from server.live.hub import SESSION_ENDED, Hub
from server.live.live_messages import (
    Focus,
    MalformedRequest,
    MapShown,
    Notice,
    PersonFix,
    Pong,
    decode_request,
)
from server.runtime.aligned_timers import SharedChecks
from wire.drops import DropReason
from wire.ids import DroneId

BROWSER_SUBPROTOCOL: Final = "tower.v1"
BAD_REQUEST: Final = 4400
MAX_BAD_REQUESTS: Final = 20
"""Malformed text messages before the channel is closed: a mistake is reported, a flood ends the channel."""
MAX_QUOTED_LENGTH: Final = 200
"""Characters of an error text: it may quote the message, and no answer exceeds this."""


class LiveChannel:
    """One browser's channel, from the accepted upgrade to its end."""

    def __init__(
        self,
        websocket: WebSocket,
        hub: Hub,
        viewer: Principal,
        *,
        clock: Clock,
        shared_checks: SharedChecks,
        subprotocol: str | None,
        still_signed_in: StillSignedIn,
        write_round: WriteRound,
    ) -> None:
        self._websocket = websocket
        self._hub = hub
        self._clock = clock
        self._shared_checks = shared_checks
        self._subprotocol = subprotocol
        self._still_signed_in = still_signed_in
        self._ending = Ending()
        self._bad_requests = 0
        self._browser = Browser(
            hub.next_browser_number(),
            viewer,
            time.monotonic(),
            wake=lambda: None,  # set by its writer
            close=self._ending.request,
            address=websocket.client.host if websocket.client else "",
        )
        self._direct = direct_writer(websocket)
        self._writer = LiveWriter(self._browser, self._direct, write_round, hub.state.traffic)

    async def run(self) -> None:
        """Runs until the browser disconnects or its session ends."""
        try:
            await self._serve()
        finally:
            self._writer.stop()

    async def _serve(self) -> None:
        await self._websocket.accept(subprotocol=self._subprotocol)
        # No await from here until it is attached: two that arrive at once must not both get the last place.
        no_room = self._hub.capacity_refusal(self._browser.viewer.user_id, self._browser.address, time.monotonic())
        if no_room is not None:
            self._hub.state.traffic.browser_closes[TOO_MANY_SOCKETS] += 1
            await close_quietly(self._websocket, TOO_MANY_SOCKETS, no_room)
            return
        self._hub.attach_browser(self._browser, self._clock().isoformat(), time.monotonic())
        self._direct.set_listeners(on_binary=self._heard)
        try:
            await until_one_ends(self._receive(), self._watch_session(), self._ending.wait())
        finally:
            self._writer.stop()
            self._direct.set_listeners()
            self._hub.detach_browser(self._browser, time.monotonic())
        if self._ending.requested:
            self._hub.state.traffic.browser_closes[self._ending.code] += 1
            await close_quietly(self._websocket, self._ending.code, self._ending.why)

    async def _receive(self) -> None:
        try:
            while not self._ending.requested:
                message = await self._websocket.receive()
                if message["type"] == "websocket.disconnect":
                    self._hub.state.drops[DropReason.MALFORMED] += is_breach(message.get("code", 0))
                    return
                now = time.monotonic()
                if (frames := message.get("bytes")) is not None:
                    self._frames(frames, now)
                elif (text := message.get("text")) is not None and self._hub.admits_request(self._browser, now):
                    self._request(text, now)
        except RuntimeError:
            return

    def _heard(self, message: bytes) -> None:
        """Handles sticks without a task: on a busy loop a task costs one more round of it."""
        if not self._ending.requested:
            self._frames(message, time.monotonic())

    def _frames(self, message: bytes, now: float) -> None:
        traffic = self._hub.state.traffic
        traffic.messages_from_browsers += 1
        traffic.bytes_from_browsers += len(message)
        passed_before = traffic.frames_to_agents
        self._hub.frames_from_browser(self._browser, message, now)
        if traffic.frames_to_agents != passed_before:
            traffic.down.observe(time.monotonic() - now)

    def _request(self, text: str, now: float) -> None:
        try:
            request = decode_request(text)
        except MalformedRequest as error:
            self._bad_requests += 1
            self._hub.state.drops[DropReason.MALFORMED] += 1
            if self._bad_requests >= MAX_BAD_REQUESTS:
                self._ending.request(BAD_REQUEST, "too many malformed messages")
            self._browser.notify(
                Notice("warning", "malformed", f"Not understood: {str(error)[:MAX_QUOTED_LENGTH]}", None, 1)
            )
            return
        visits = self._hub.visits
        if visits is not None and visits.request(self._browser, request, text):
            return
        if isinstance(request, Focus):
            drone_id = None if request.drone_id is None else DroneId(request.drone_id)
            self._hub.audience.focus(self._browser, drone_id, now)
        elif isinstance(request, PersonFix):
            self._hub.person_fix(self._browser, request, now)
        elif isinstance(request, Pong):
            self._browser.trip.pong(request.sequence, now)
        elif isinstance(request, MapShown):
            bounds = request.bounds
            shown = None if bounds is None else Viewport(bounds.south, bounds.west, bounds.north, bounds.east)
            self._hub.audience.show_map(self._browser, shown)
        else:
            self._browser.outbox.set_watch_rate(request.rate_hz, now)

    async def _watch_session(self) -> None:
        await watch_session(
            self._browser.viewer,
            clock=self._clock,
            shared_checks=self._shared_checks,
            still_signed_in=self._still_signed_in,
            over=self._session_over,
        )

    def _session_over(self, why: str) -> None:
        self._hub.end_sessions([self._browser.viewer.session_id], why)
        self._ending.request(SESSION_ENDED, why)
