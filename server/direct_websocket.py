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

from server.guarded_websocket import GuardedWebSocket

EXTENSION: Final = "tower.direct"

_TEXT: Final = 0x81
_BINARY: Final = 0x82


class DirectWriter(Protocol):
    """What the live channel uses of it."""

    on_room: Callable[[], None]
    """Called when there is room again."""

    def has_room(self) -> bool:
        """False while the other side does not read what it was sent: HIGH_WATER_BYTES wait in the transport."""

    def write_binary(self, payload: bytes) -> None:
        """One binary message. Nothing happens on a connection that is closing or gone."""

    def write_text(self, payload: bytes) -> None:
        """One text message, UTF-8."""


class DirectWebSocket(GuardedWebSocket):
    """What `TowerServer` gives to uvicorn as its WebSocket implementation. It is a DirectWriter."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.on_room: Callable[[], None] = _nothing

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

    def resume_writing(self) -> None:
        super().resume_writing()
        self.on_room()

    def connection_lost(self, exc: Exception | None) -> None:
        self.on_room = _nothing
        super().connection_lost(exc)

    def has_room(self) -> bool:
        return self.writable.is_set()

    def write_binary(self, payload: bytes) -> None:
        self._write(_BINARY, payload)

    def write_text(self, payload: bytes) -> None:
        self._write(_TEXT, payload)

    def _write(self, first: int, payload: bytes) -> None:
        if self.close_sent or self.disconnected or not self.handshake_complete or self.transport.is_closing():
            return
        size = len(payload)
        if size < 126:
            head = bytes((first, size))
        elif size < 1 << 16:
            head = bytes((first, 126, size >> 8, size & 0xFF))
        else:
            head = bytes((first, 127)) + size.to_bytes(8, "big")
        self.transport.write(head + payload)


def direct_writer(websocket: WebSocket) -> DirectWriter:
    """The writer of a connection. Raises KeyError if the server is not ours."""
    return cast("DirectWriter", websocket.scope["extensions"][EXTENSION])


def _nothing() -> None:
    pass
