"""uvicorn's WebSocket with a second way out: whole messages written straight to the transport, without a task.

ASGI's `send` costs a dictionary, three layers of coroutines and a state machine for each message: on a server that has
just woken up several times what it takes to decrypt, check and route the frames in it. A server's message is two to
ten bytes and the payload (RFC 6455, 5.2), so the live channel writes it itself. Opening, closing, pings, everything
that comes in and everything that is rare stay uvicorn's.

The application finds the writer in `scope["extensions"][EXTENSION]`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Protocol, cast

from starlette.websockets import WebSocket
from websockets.http11 import Request

from server.api.websocket.frame_ears import FrameEars, Listener
from server.api.websocket.guarded_websocket import SLICE_BYTES, GuardedWebSocket
from server.live.video.websocket_bytes import BINARY, PING, TEXT, whole_message

EXTENSION: Final = "tower.direct"


class DirectWriter(Protocol):
    """What the live channel uses of it."""

    on_room: Callable[[], None]
    """Called when there is room again."""
    on_full: Callable[[], None]
    """Called when there is no more, within the write that filled it."""

    def has_room(self) -> bool:
        """False while the other side does not read what it was sent: HIGH_WATER_BYTES wait in the transport."""

    def write_binary(self, payload: bytes) -> None:
        """One binary message. Nothing happens on a connection that is closing or gone."""

    def write_text(self, payload: bytes) -> None:
        """One text message, UTF-8."""

    def write_whole(self, message: bytes) -> None:
        """A message made by server.live.video.websocket_bytes: the same bytes for any number of connections."""

    def write_ping(self) -> None:
        """A small ping, unless something waits in the transport already."""

    def take_messages(self, *, largest_bytes: int, slice_bytes: int = SLICE_BYTES) -> None:
        """From here on a message from the other side may have so many bytes; so much of what comes is parsed at a
        time (server.api.websocket.guarded_websocket)."""

    def hear(self, *, on_text: Listener | None = None, on_binary: Listener | None = None) -> None:
        """From here on these are called with the messages that frame_ears describes, at once and without a task; binary
        ones up to what `take_messages` says. All other messages come as they did: so does everything, from a client
        that spoke before the handshake was over."""


class DirectWebSocket(GuardedWebSocket):
    """What `TowerServer` gives to uvicorn as its WebSocket implementation. It is a DirectWriter."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.on_room: Callable[[], None] = _nothing
        self.on_full: Callable[[], None] = _nothing
        self.has_room: Callable[[], bool] = self.writable.is_set
        self._ears: FrameEars | None = None
        self._chunks = 0
        """That came before `hear`; the first is the handshake."""

    def handle_connect(self, event: Request) -> None:
        super().handle_connect(event)
        if hasattr(self, "scope"):  # the handshake was good; the application's task has not begun yet
            cast("dict[str, Any]", self.scope["extensions"])[EXTENSION] = self

    async def run_asgi(self) -> None:
        try:
            await super().run_asgi()
        finally:
            # Else the connection would hold itself, and wait for the garbage collector.
            cast("dict[str, Any]", self.scope["extensions"]).pop(EXTENSION, None)

    def pause_writing(self) -> None:
        super().pause_writing()
        self.on_full()

    def resume_writing(self) -> None:
        super().resume_writing()
        self.on_room()

    def connection_lost(self, exc: Exception | None) -> None:
        self.on_room = self.on_full = _nothing
        self._ears = None
        super().connection_lost(exc)

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

    # -- what comes in -------------------------------------------------------------------------------------------

    def take_messages(self, *, largest_bytes: int, slice_bytes: int = SLICE_BYTES) -> None:
        self.conn.max_message_size = largest_bytes
        self._slice_bytes = slice_bytes

    def hear(self, *, on_text: Listener | None = None, on_binary: Listener | None = None) -> None:
        # Who sent something before the handshake was over has a parser that may be within a frame.
        if self._chunks == 1 and not self._unparsed:
            largest = self.conn.max_message_size or 0
            self._ears = FrameEars(
                self._parse, self._is_parsing, on_text=on_text, on_binary=on_binary, largest_binary=largest
            )

    def data_received(self, data: bytes) -> None:
        if self._ears is None or self.close_sent:
            self._chunks += 1
            super().data_received(data)
        else:
            self._ears.hear(data)

    def _parse(self, data: bytes) -> None:
        super().data_received(data)

    def _is_parsing(self) -> bool:
        # What the parser made of the last bytes may still wait for the application: nothing may overtake it.
        return bool(self._unparsed or self.frames or self.close_sent or not self.queue.empty())


def direct_writer(websocket: WebSocket) -> DirectWriter:
    """The writer of a connection. Raises KeyError if the server is not ours."""
    return cast("DirectWriter", websocket.scope["extensions"][EXTENSION])


def _nothing() -> None:
    pass
