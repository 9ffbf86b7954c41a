"""uvicorn's WebSocket, with bounds where it has none: what one peer sends, or does not read, costs the others nothing.

- A peer that does not read, or a byte a second, would keep its connection and what waits for it for ever, even after it
  was closed: it is cut after STALLED_AFTER_S.
- For one that reads more slowly than it is written to, the kernel would take megabytes of old news: NOT_SENT_BYTES.
- One that pings and never reads would pile up pongs: while nothing can be written, no ping is answered.
- Thousands of tiny messages that come at once would keep the loop busy: they are parsed SLICE_BYTES at a time, and the
  rest when those are handled.
- The empty pieces of a message without end would pile up: it has MAX_PIECES, then it is closed with 1009.
- A connection that was broken off, or ended by a fault, would stay in memory: it lets go of its parser at the end.
- A refused upgrade would be called an error of ours, in the log, by anybody who likes to.
"""

from __future__ import annotations

import asyncio
import socket
from typing import TYPE_CHECKING, Any, Final, cast

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode, Frame

from server.api.anonymous.visit_scope import GUEST
from server.live.anonymous.connections import AnonymousConnection, ConnectionBudget

if TYPE_CHECKING:
    from uvicorn._types import ASGIReceiveEvent, ASGISendEvent

STALLED_AFTER_S: Final = 20.0
"""With the buffer below this is 3 kB/s: what reads more slowly than that is no use for flying or watching."""
LINGER_S: Final = 5.0
"""For the rest of what was sent, and the closing handshake, once the application is done with a connection."""
HIGH_WATER_BYTES: Final = 32 * 1024
LOW_WATER_BYTES: Final = 8 * 1024
NOT_SENT_BYTES: Final = 16 * 1024
"""What the kernel takes beyond what is on its way: the newest state is chosen late, not queued early."""
SLICE_BYTES: Final = 4 * 1024
"""At most 680 messages: a few milliseconds."""
MAX_PIECES: Final = 64
MAX_SINCE_CLOSE_BYTES: Final = 64 * 1024

_NOT_SENT: Final = getattr(socket, "TCP_NOTSENT_LOWAT", None)


class GuardedWebSocket(WebSocketsSansIOProtocol):
    """Under what `TowerServer` gives to uvicorn (server.api.websocket.direct_websocket)."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._unparsed = b""
        self._slice_bytes = SLICE_BYTES
        self._slice_planned = False
        self._since_close = 0
        self._stalled: asyncio.TimerHandle | None = None
        self._lingering: asyncio.TimerHandle | None = None
        self._guest: tuple[AnonymousConnection, ConnectionBudget] | None = None

    def is_guest(self, guest: AnonymousConnection, connections: ConnectionBudget) -> None:
        """It has not signed in, and counts as that until it has, or ends."""
        self._guest = guest, connections
        if hasattr(self, "scope"):  # the handshake was good; the application's task has not begun yet
            cast("dict[str, Any]", self.scope)[GUEST] = guest
        if self.transport.is_closing():
            connections.gone(guest)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(high=HIGH_WATER_BYTES, low=LOW_WATER_BYTES)
        own_socket = transport.get_extra_info("socket")
        if _NOT_SENT is not None and own_socket is not None:
            own_socket.setsockopt(socket.IPPROTO_TCP, _NOT_SENT, NOT_SENT_BYTES)

    def connection_lost(self, exc: Exception | None) -> None:
        self._unparsed = b""
        for timer in (self._stalled, self._lingering):
            if timer is not None:
                timer.cancel()
        if self._guest is not None:
            guest, connections = self._guest
            connections.gone(guest)
        super().connection_lost(exc)
        # The parser is a generator that knows `conn`, as `conn` knows it, and the fault that ended it.
        self.conn.parser.close()
        self.conn.parser_exc = None

    # -- what it does not read -------------------------------------------------------------------------------

    def pause_writing(self) -> None:
        super().pause_writing()
        self._stalled = self.loop.call_later(STALLED_AFTER_S, self.transport.abort)

    def resume_writing(self) -> None:
        if self._stalled is not None:
            self._stalled.cancel()
        super().resume_writing()

    def handle_ping(self) -> None:
        if self.writable.is_set():
            super().handle_ping()
        else:
            self.conn.data_to_send()

    def keepalive_timeout(self) -> None:
        super().keepalive_timeout()
        self._cut_soon()

    async def run_asgi(self) -> None:
        try:
            await super().run_asgi()
        finally:
            self._cut_soon()

    async def send(self, message: ASGISendEvent) -> None:
        await super().send(message)
        if self.close_sent:  # a refusal ends the handshake too
            self.handshake_complete = True

    def _cut_soon(self) -> None:
        if self._lingering is None and not self.disconnected:
            self._lingering = self.loop.call_later(LINGER_S, self.transport.abort)

    # -- what it sends ---------------------------------------------------------------------------------------

    def data_received(self, data: bytes) -> None:
        if self.close_sent:
            # Somewhere in there may be the answer to our goodbye. Who goes on sending is not worth looking for it.
            self._since_close += len(data)
            if self._since_close > MAX_SINCE_CLOSE_BYTES:
                return
        if len(data) <= self._slice_bytes and not self._unparsed:
            super().data_received(data)
            return
        self._unparsed += data
        self._parse_slice()

    def _parse_slice(self) -> None:
        """One slice now; the next one when the application has taken the messages of this one (see `receive`)."""
        self._slice_planned = False
        if self.transport.is_closing():
            self._unparsed = b""
            return
        size = self._slice_bytes
        part, self._unparsed = self._unparsed[:size], self._unparsed[size:]
        if part:
            super().data_received(part)
        if not self._unparsed:
            return
        if not self.read_paused:
            self.read_paused = True
            self.transport.pause_reading()
        if self.queue.empty():
            self._plan_slice()

    def _plan_slice(self) -> None:
        if not self._slice_planned:
            self._slice_planned = True
            self.loop.call_soon(self._next_slice)

    def _next_slice(self) -> None:
        self._parse_slice()
        if not self._unparsed and self.read_paused and self.queue.empty():
            self.read_paused = False
            self.transport.resume_reading()

    async def receive(self) -> ASGIReceiveEvent:
        message = await self.queue.get()
        if self.queue.empty():
            if self._unparsed:
                self._plan_slice()
            elif self.read_paused:
                self.read_paused = False
                self.transport.resume_reading()
        return message

    def handle_cont(self, event: Frame) -> None:
        if self.close_sent:
            return
        if len(self.frames) >= MAX_PIECES:
            self.conn.fail(CloseCode.MESSAGE_TOO_BIG, "a message in too many pieces")
            self.handle_parser_exception()
            return
        super().handle_cont(event)
