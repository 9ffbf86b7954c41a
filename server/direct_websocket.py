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
from websockets.utils import apply_mask

from server.guarded_websocket import SLICE_BYTES, GuardedWebSocket
from server.websocket_bytes import BINARY, TEXT, whole_message

EXTENSION: Final = "tower.direct"

_MASKED_TEXT: Final = 0x81
_MASK: Final = 0x80
_LARGEST_SHORT: Final = 125
_HEAD_BYTES: Final = 6
"""Of a short message from a client: two, and the mask."""


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

    def write_whole(self, message: bytes) -> None:
        """A message that was made ready (server.websocket_bytes): the same bytes for any number of connections."""

    def take_messages(self, *, largest_bytes: int, slice_bytes: int = SLICE_BYTES) -> None:
        """From here on a message from the other side may have so many bytes; so much of what comes is parsed at a
        time (server.guarded_websocket)."""

    def hear_short_texts(self, listener: Callable[[bytes], None]) -> None:
        """From here on `listener` is called with each text message of up to 125 bytes that comes whole, at once and
        without a task. It may have come as something else than UTF-8. All other messages come as they did."""


class DirectWebSocket(GuardedWebSocket):
    """What `TowerServer` gives to uvicorn as its WebSocket implementation. It is a DirectWriter."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.on_room: Callable[[], None] = _nothing
        self._on_short_text: Callable[[bytes], None] | None = None
        self._chunks = 0
        """That came while nobody heard short texts; the first is the handshake."""
        self._frame_left = 0
        """Bytes of a frame that are to come, which the parser has begun."""

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
        self._on_short_text = None
        super().connection_lost(exc)

    def has_room(self) -> bool:
        return self.writable.is_set()

    def write_binary(self, payload: bytes) -> None:
        self.write_whole(whole_message(BINARY, payload))

    def write_text(self, payload: bytes) -> None:
        self.write_whole(whole_message(TEXT, payload))

    def write_whole(self, message: bytes) -> None:
        if self.close_sent or self.disconnected or not self.handshake_complete or self.transport.is_closing():
            return
        self.transport.write(message)

    # -- short texts that come in --------------------------------------------------------------------------------

    def take_messages(self, *, largest_bytes: int, slice_bytes: int = SLICE_BYTES) -> None:
        self.conn.max_message_size = largest_bytes
        self._slice_bytes = slice_bytes

    def hear_short_texts(self, listener: Callable[[bytes], None]) -> None:
        # Who sent something before the handshake was over has a parser that may be within a frame.
        if self._chunks == 1 and not self._unparsed:
            self._on_short_text = listener

    def data_received(self, data: bytes) -> None:
        listener = self._on_short_text
        if listener is None or self.close_sent:
            self._chunks += 1
            super().data_received(data)
            return
        if len(data) > SLICE_BYTES and not self._frame_left:
            self._on_short_text = None  # so much at once is not what short texts are for: in slices, from here on
            super().data_received(data)
            return
        # From frame to frame. What is short, text and whole is heard here; runs of all else go to the parser.
        at = rest_from = 0
        size = len(data)
        while at < size:
            if self._frame_left:
                step = min(self._frame_left, size - at)
                self._frame_left -= step
                at += step
                continue
            end = _end_of_short_text(data, at)
            if end:
                if rest_from < at:
                    super().data_received(data[rest_from:at])
                if self._unparsed or self.frames or self.close_sent:
                    # The order of messages counts: what came before this one is not through yet.
                    super().data_received(data[at:end])
                else:
                    listener(_unmasked(data, at, end))
                at = rest_from = end
                continue
            whole = _frame_bytes(data, at)
            if whole is None:  # the head is cut in two: from here on the parser has it all
                self._on_short_text = None
                break
            self._frame_left = whole
        if rest_from < size:
            super().data_received(data[rest_from:])


def _end_of_short_text(data: bytes, at: int) -> int:
    """Where a short, whole, masked text message ends that begins here; 0: here is something else."""
    if len(data) - at < _HEAD_BYTES or data[at] != _MASKED_TEXT:
        return 0
    length = data[at + 1] - _MASK
    end = at + _HEAD_BYTES + length
    return end if 0 <= length <= _LARGEST_SHORT and end <= len(data) else 0


def _unmasked(data: bytes, at: int, end: int) -> bytes:
    return apply_mask(data[at + _HEAD_BYTES : end], data[at + 2 : at + _HEAD_BYTES])


def _frame_bytes(data: bytes, at: int) -> int | None:
    """Of the frame that begins here, head and all; None: its head has not come whole."""
    have = len(data) - at
    if have < 2:
        return None
    length, mask = data[at + 1] & 0x7F, 4 if data[at + 1] & _MASK else 0
    more = {126: 2, 127: 8}.get(length, 0)
    if have < 2 + more:
        return None
    if more:
        length = int.from_bytes(data[at + 2 : at + 2 + more])
    return 2 + more + mask + length


def direct_writer(websocket: WebSocket) -> DirectWriter:
    """The writer of a connection. Raises KeyError if the server is not ours."""
    return cast("DirectWriter", websocket.scope["extensions"][EXTENSION])


def _nothing() -> None:
    pass
