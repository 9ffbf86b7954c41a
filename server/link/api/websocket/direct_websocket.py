"""The tower's WebSocket: uvicorn's protocol over the sans-I/O parser of websockets, with bounds and a direct path.

This is the only module that knows the internals of `WebSocketsSansIOProtocol`. pyproject.toml pins uvicorn and
websockets exactly, and tests/unit/server/test_uvicorn_contract.py fails when either changes: compare this file with the
new version, then change the figures there (docs/adr/0010-one-websocket-parser.md).

**Bounds**: what one peer sends, or does not read, costs the others nothing.

- A peer that does not read, or reads a byte a second, would keep its connection and its queued data forever, even after
  a close: it is cut after STALLED_AFTER_S.
- For a peer that reads more slowly than it is written to, the kernel would buffer megabytes of stale data:
  NOT_SENT_BYTES.
- A peer that pings and never reads would pile up pongs: while nothing can be written, no ping is answered.
- Thousands of tiny messages at once would keep the loop busy: they are parsed SLICE_BYTES at a time, and the rest once
  those are handled.
- The empty fragments of an endless message would pile up: a message has at most MAX_PIECES, then it is closed with
  1009.
- A peer that has not signed in sends little, in turns with other strangers (`handshake_reader.py`).
- A connection that broke or ended by an error would stay in memory: it drops its parser at the end.
- Anybody could cause a refused upgrade, which would be logged as an error of the tower.

**Direct**: ASGI's dictionaries, queue and task cost about a hundred microseconds per message, in either direction; the
parser costs three. Whole messages are written straight to the transport (RFC 6455, 5.2), and received messages can be
handled within the call that delivered their bytes. Opening, closing, pings and everything rare stay uvicorn's. The
application finds the writer in `scope["extensions"][EXTENSION]`.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, Protocol, cast

from starlette.websockets import WebSocket
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode, Frame
from websockets.http11 import Request

from server.anonymous.api.anonymous_scope import ANONYMOUS_CONNECTION, ON_ADMITTED
from server.anonymous.api.read_turns import ReadTurns
from server.anonymous.core.budget import AnonymousBudget
from server.anonymous.core.connections import AnonymousConnection, ConnectionBudget
from server.link.api.websocket.handshake_reader import HandshakeReader
from server.video.core.websocket_bytes import BINARY, PING, PONG, TEXT, whole_message

if TYPE_CHECKING:
    from uvicorn._types import ASGIReceiveEvent, ASGISendEvent

EXTENSION: Final = "tower.direct"

Listener = Callable[[bytes], None]

STALLED_AFTER_S: Final = 20.0
"""With the buffer below this is 3 kB/s: a slower reader is no use for flying or watching."""
LINGER_S: Final = 5.0
"""Time for the rest of the data and the closing handshake, once the application is done with a connection."""
HIGH_WATER_BYTES: Final = 32 * 1024
LOW_WATER_BYTES: Final = 8 * 1024
NOT_SENT_BYTES: Final = 16 * 1024
"""Bytes that the kernel accepts beyond those in flight: the newest state is chosen late, not queued early."""
SLICE_BYTES: Final = 4 * 1024
"""At most 680 messages: a few milliseconds."""
MAX_PIECES: Final = 64
MAX_SINCE_CLOSE_BYTES: Final = 64 * 1024
MAX_HEARD_TEXT_BYTES: Final = 125
"""Longer texts are requests, for the application's task."""

_NOT_SENT: Final = getattr(socket, "TCP_NOTSENT_LOWAT", None)


class DirectWriter(Protocol):
    """The part that the live channel uses."""

    on_room: Callable[[], None]
    """Called when there is room again."""
    on_full: Callable[[], None]
    """Called when the buffer is full, within the write that filled it."""

    def has_room(self) -> bool:
        """False while the peer does not read: HIGH_WATER_BYTES wait in the transport."""

    def write_binary(self, payload: bytes) -> None:
        """Writes one binary message. Does nothing on a connection that is closing or closed."""

    def write_text(self, payload: bytes) -> None:
        """Writes one text message, UTF-8."""

    def write_whole(self, message: bytes) -> None:
        """Writes a message built by server.video.core.websocket_bytes: the same bytes for any number of connections."""

    def write_ping(self) -> None:
        """Writes a small ping, unless data already waits in the transport."""

    def write_pong(self) -> None:
        """Writes a small frame that gets no answer, unless data already waits in the transport."""

    def take_messages(self, *, largest_bytes: int, slice_bytes: int = SLICE_BYTES) -> None:
        """Sets the maximum size of a received message, and how many received bytes are parsed at a time."""

    def set_listeners(self, *, on_text: Listener | None = None, on_binary: Listener | None = None) -> None:
        """Sets listeners for whole messages, called within the call that delivers their bytes: `on_text` for texts of
        up to MAX_HEARD_TEXT_BYTES, which may not be valid UTF-8, `on_binary` for all binary messages. Fragmented
        messages, and messages behind one that waits for the application, take the ordinary path."""


class DirectWebSocket(WebSocketsSansIOProtocol):
    """The WebSocket implementation that `TowerServer` gives to uvicorn. Implements DirectWriter."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._unparsed = b""
        self._slice_bytes = SLICE_BYTES
        self._slice_planned = False
        self._since_close = 0
        self._stalled: asyncio.TimerHandle | None = None
        self._lingering: asyncio.TimerHandle | None = None
        self._anonymous: tuple[AnonymousConnection, ConnectionBudget] | None = None
        self._reader: HandshakeReader | None = None
        self._on_text: Listener | None = None
        self._on_binary: Listener | None = None
        self.on_room: Callable[[], None] = _nothing
        self.on_full: Callable[[], None] = _nothing
        self.has_room: Callable[[], bool] = self.writable.is_set

    def handle_connect(self, event: Request) -> None:
        super().handle_connect(event)
        if hasattr(self, "scope"):  # the handshake succeeded; the application's task has not begun yet
            cast("dict[str, Any]", self.scope["extensions"])[EXTENSION] = self

    def count_as_anonymous(
        self, anonymous: AnonymousConnection, budget: AnonymousBudget, turns: ReadTurns | None
    ) -> None:
        """Counts the connection as not signed in until it signs in or ends."""
        self._anonymous = anonymous, budget.connections
        if hasattr(self, "scope"):  # the handshake succeeded; the application's task has not begun yet
            cast("dict[str, Any]", self.scope)[ANONYMOUS_CONNECTION] = anonymous
            if turns is not None:
                reader = HandshakeReader(self, self._received, anonymous=anonymous, budget=budget, turns=turns)
                self._reader = reader
                cast("dict[str, Any]", self.scope)[ON_ADMITTED] = self._admitted
        if self.transport.is_closing():
            budget.connections.gone(anonymous)

    def _admitted(self) -> None:
        if self._reader is not None:
            self._reader.is_admitted = True

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(high=HIGH_WATER_BYTES, low=LOW_WATER_BYTES)
        own_socket = transport.get_extra_info("socket")
        if _NOT_SENT is not None and own_socket is not None:
            own_socket.setsockopt(socket.IPPROTO_TCP, _NOT_SENT, NOT_SENT_BYTES)

    def connection_lost(self, exc: Exception | None) -> None:
        self.on_room = self.on_full = _nothing
        self._on_text = self._on_binary = None
        self._unparsed = b""
        self._reader = None
        for timer in (self._stalled, self._lingering):
            if timer is not None:
                timer.cancel()
        if self._anonymous is not None:
            anonymous, connections = self._anonymous
            connections.gone(anonymous)
        super().connection_lost(exc)
        # The parser is a generator that refers to `conn`, and `conn` refers to it and to the error that ended it.
        self.conn.parser.close()
        self.conn.parser_exc = None

    # -- peers that do not read ------------------------------------------------------------------------------

    def pause_writing(self) -> None:
        super().pause_writing()
        self._stalled = self.loop.call_later(STALLED_AFTER_S, self.transport.abort)
        self.on_full()

    def resume_writing(self) -> None:
        if self._stalled is not None:
            self._stalled.cancel()
        super().resume_writing()
        self.on_room()

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
            # Otherwise the connection would refer to itself and wait for the garbage collector.
            cast("dict[str, Any]", self.scope["extensions"]).pop(EXTENSION, None)
            cast("dict[str, Any]", self.scope).pop(ON_ADMITTED, None)

    async def send(self, message: ASGISendEvent) -> None:
        await super().send(message)
        if self.close_sent:  # a refusal ends the handshake too
            self.handshake_complete = True

    def _cut_soon(self) -> None:
        if self._lingering is None and not self.disconnected:
            self._lingering = self.loop.call_later(LINGER_S, self.transport.abort)

    # -- whole messages, past ASGI ----------------------------------------------------------------------------

    def write_binary(self, payload: bytes) -> None:
        self.write_whole(whole_message(BINARY, payload))

    def write_text(self, payload: bytes) -> None:
        self.write_whole(whole_message(TEXT, payload))

    def write_whole(self, message: bytes) -> None:
        if self.close_sent or self.disconnected or not self.handshake_complete or self.transport.is_closing():
            return
        self.transport.write(message)

    def write_ping(self) -> None:
        if not self.transport.get_write_buffer_size():
            self.write_whole(PING)

    def write_pong(self) -> None:
        if not self.transport.get_write_buffer_size():
            self.write_whole(PONG)

    def take_messages(self, *, largest_bytes: int, slice_bytes: int = SLICE_BYTES) -> None:
        self.conn.max_message_size = largest_bytes
        self._slice_bytes = slice_bytes

    def set_listeners(self, *, on_text: Listener | None = None, on_binary: Listener | None = None) -> None:
        self._on_text, self._on_binary = on_text, on_binary

    def handle_text(self, event: Frame) -> None:
        if self._on_text is None or len(event.data) > MAX_HEARD_TEXT_BYTES or not self._is_next(event):
            super().handle_text(event)
        else:
            self._on_text(cast("bytes", event.data))

    def handle_bytes(self, event: Frame) -> None:
        if self._on_binary is None or not self._is_next(event):
            super().handle_bytes(event)
        else:
            self._on_binary(cast("bytes", event.data))

    def _is_next(self, event: Frame) -> bool:
        """Whether it is a whole message, and no earlier one waits for the application."""
        return event.fin and not self.close_sent and self.queue.empty()

    # -- received bytes --------------------------------------------------------------------------------------

    def data_received(self, data: bytes) -> None:
        if self._reader is not None and self._reader.is_over:
            self._reader = None
        if self._reader is None:
            self._received(data)
        else:
            self._reader.came(data)

    def is_closing(self) -> bool:
        """See HandshakeSocket."""
        return self.transport.is_closing()

    def pause(self) -> None:
        """See HandshakeSocket."""
        if not self.transport.is_closing():
            self.transport.pause_reading()

    def resume(self) -> None:
        """See HandshakeSocket."""
        if not self.read_paused:
            self.transport.resume_reading()

    def abort(self) -> None:
        """See HandshakeSocket."""
        self.transport.abort()

    def _received(self, data: bytes) -> None:
        if self.close_sent:
            # The answer to our close may be in there. If the peer keeps sending, it is not worth searching.
            self._since_close += len(data)
            if self._since_close > MAX_SINCE_CLOSE_BYTES:
                return
        if len(data) <= self._slice_bytes and not self._unparsed:
            super().data_received(data)
            return
        self._unparsed += data
        self._parse_slice()

    def _parse_slice(self) -> None:
        """Parses one slice; the next follows when the application has taken the messages of this one (see
        `receive`)."""
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


def direct_writer(websocket: WebSocket) -> DirectWriter:
    """Returns the writer of a connection. Raises KeyError if the server is not ours."""
    return cast("DirectWriter", websocket.scope["extensions"][EXTENSION])


def _nothing() -> None:
    pass
