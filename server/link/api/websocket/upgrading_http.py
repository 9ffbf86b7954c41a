"""uvicorn's HTTP, with additional bounds, and without leftovers when a WebSocket begins.

- A client that sends an endless head would make the process store and parse it while everybody's frames wait: a request
  has at most MAX_HEADERS headers and MAX_HEAD_BYTES around its body. More yields 431, and the connection is closed.
- A client that connects and sends nothing, or a byte now and then, would keep the connection forever, and thousands of
  them would use up all file descriptors: the head of a request must arrive within HEAD_WITHIN_S. (Between requests,
  uvicorn waits for 5 s.)
- A client that sends thousands of short requests at once would have each of them made ready before the next frame:
  MAX_PIPELINED of them may wait for the answer to one. More close the connection.
- A client that does not read its answer would keep it in memory for as long as it likes: it is cut after
  STALLED_AFTER_S, as a WebSocket is.
- Bytes of a connection that has not signed in are parsed when it is its turn (server.anonymous.api.read_turns), a few
  kilobytes at a time.
- The parser and the connection refer to each other. uvicorn separates them at the end, but not after an upgrade: both
  would wait for the garbage collector, which runs seldom (server/runtime/garbage.py), with all data of the request.
"""

import asyncio
from typing import Any, Final, cast

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

from server.anonymous.api.anonymous_scope import ANONYMOUS_CONNECTION
from server.anonymous.api.read_turns import ReadTurns
from server.anonymous.core.budget import AnonymousBudget, Over
from server.anonymous.core.connections import AnonymousConnection
from server.anonymous.core.limits import LIMITS
from server.link.api.websocket.direct_websocket import STALLED_AFTER_S, DirectWebSocket

HEAD_WITHIN_S: Final = LIMITS.head_within_s
MAX_HEADERS: Final = LIMITS.max_headers
MAX_HEAD_BYTES: Final = LIMITS.max_head_bytes
MAX_PIPELINED: Final = LIMITS.max_pipelined_requests
TURN_BYTES: Final = LIMITS.read_turn_bytes
MAX_CHUNKING_FACTOR: Final = 8
"""A body in chunks of one byte takes six bytes for each."""

_TOO_LARGE: Final = b"HTTP/1.1 431 Request Header Fields Too Large\r\ncontent-length: 0\r\nconnection: close\r\n\r\n"


def _nothing() -> None:
    pass


class _TooMuchError(Exception):
    """Ends the parsing: httptools re-raises it as an error of its own."""


class UpgradingHttp(HttpToolsProtocol):
    """The HTTP implementation that `TowerServer` gives to uvicorn."""

    def __init__(
        self,
        *args: Any,
        budget: AnonymousBudget | None = None,
        turns: ReadTurns | None = None,
        anonymous: AnonymousConnection | None = None,
        **options: Any,
    ) -> None:
        """`anonymous`: what the connection counts as until it signs in; without one nothing is counted."""
        super().__init__(*args, **options)
        self.anonymous = anonymous
        self.unread = b""
        self._budget = budget
        self._turns = turns
        self._no_head: asyncio.TimerHandle | None = None
        self._stalled: asyncio.TimerHandle | None = None
        self._around_body = 0
        """Bytes of this request so far outside its body."""
        self._body = 0
        self._over: Over | None = None
        """Why the parsing was ended."""
        self._running: RequestResponseCycle | None = None
        """The request that is being answered; others may wait behind it."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        if self.anonymous is not None:
            self.anonymous.cut = transport.abort
        self._wait_for_head()

    def connection_lost(self, exc: Exception | None) -> None:
        self._head_is_there()
        self._reads_again()
        if self.anonymous is not None and self._budget is not None:
            self._budget.connections.gone(self.anonymous)
        super().connection_lost(exc)
        # uvicorn tells this only to the newest request. One that writes to a closed connection raises.
        if self._running is not None:
            self._running.disconnected = True
            self._running.message_event.set()
            self._running = None
        # It also leaves requests that had not begun: each refers to this connection, and the connection to them.
        for cycle, _ in self.pipeline:
            cycle.on_response = _nothing
        self.pipeline.clear()

    def data_received(self, data: bytes) -> None:
        if self.anonymous is None or self._turns is None or (self.anonymous.is_admitted and not self.unread):
            self._parse(data)
        else:
            self._turns.came(self, data)

    def pause_writing(self) -> None:
        super().pause_writing()
        self._stalled = self.loop.call_later(STALLED_AFTER_S, self.transport.abort)

    def resume_writing(self) -> None:
        self._reads_again()
        super().resume_writing()

    def _reads_again(self) -> None:
        if self._stalled is not None:
            self._stalled.cancel()
            self._stalled = None

    # -- turns of connections that have not signed in (AnonymousReader) ------------------------------------------

    def hold_reading(self) -> None:
        self.transport.pause_reading()
        self._unset_keepalive_if_required()  # it waits for us now
        if self._no_head is None and (self.cycle is None or self.cycle.response_complete):
            self._wait_for_head()

    def take_turn(self) -> None:
        data, self.unread = self.unread, b""
        if self.parser is None or self.transport.is_closing():
            return
        self._parse(data[:TURN_BYTES])
        if self.transport.is_closing():
            return
        # The protocol that took over may have paused reading for its own reason. It gets nothing of what was sent
        # before the upgrade was answered.
        taker = self.transport.get_protocol()
        if len(data) > TURN_BYTES and taker is self and self._turns is not None:
            self._turns.later(self, data[TURN_BYTES:])
            return
        paused = taker.read_paused if isinstance(taker, DirectWebSocket) else self.flow.read_paused
        if not paused:
            self.transport.resume_reading()

    def cut(self) -> None:
        self.unread = b""
        self.transport.abort()

    def _parse(self, data: bytes) -> None:
        self._around_body += len(data)
        super().data_received(data)
        if self.parser is None or self.transport.is_closing():
            return
        if self._around_body > MAX_HEAD_BYTES + MAX_CHUNKING_FACTOR * self._body:
            self._refuse(Over.HEAD)
            return
        # Line ends between requests do not begin one, but have stopped uvicorn's own timer.
        idle = self.cycle is None or self.cycle.response_complete
        if idle and self._no_head is None and self.timeout_keep_alive_task is None and self.parser is not None:
            self._wait_for_head()

    def send_400_response(self, msg: str) -> None:
        if self._over is not None:
            self._refuse(self._over)
        else:
            super().send_400_response(msg)

    def _refuse(self, over: Over) -> None:
        self._head_is_there()
        self._count(over)
        cycle = self.cycle
        if over is Over.HEAD and (cycle is None or cycle.response_complete or not cycle.response_started):
            self.transport.write(_TOO_LARGE)
        self.transport.close()

    def on_message_begin(self) -> None:
        if len(self.pipeline) >= MAX_PIPELINED:
            self._over = Over.PIPELINE
            raise _TooMuchError
        super().on_message_begin()
        cast("dict[str, Any]", self.scope)[ANONYMOUS_CONNECTION] = self.anonymous
        self._around_body = self._body = 0
        if self._no_head is None:
            self._wait_for_head()

    def on_header(self, name: bytes, value: bytes) -> None:
        if len(self.headers) >= MAX_HEADERS:
            self._over = Over.HEAD
            raise _TooMuchError
        super().on_header(name, value)

    def on_body(self, body: bytes) -> None:
        self._body += len(body)
        self._around_body -= len(body)
        super().on_body(body)

    def on_headers_complete(self) -> None:
        self._head_is_there()
        super().on_headers_complete()

    def _start_asgi_task(self, cycle: RequestResponseCycle, app: Any) -> None:
        self._running = cycle
        super()._start_asgi_task(cycle, app)

    def handle_websocket_upgrade(self) -> None:
        super().handle_websocket_upgrade()
        # From here on the WebSocket receives everything.
        self.parser = None  # type: ignore[assignment]
        taker = self.transport.get_protocol()
        if self.anonymous is not None and self._budget is not None and isinstance(taker, DirectWebSocket):
            taker.count_as_anonymous(self.anonymous, self._budget, self._turns)

    def _wait_for_head(self) -> None:
        self._no_head = self.loop.call_later(HEAD_WITHIN_S, self._no_head_came)

    def _no_head_came(self) -> None:
        self._count(Over.HEAD_TIME)
        self.transport.abort()

    def _count(self, over: Over) -> None:
        if self._budget is not None:
            self._budget.refused[over] += 1

    def _head_is_there(self) -> None:
        if self._no_head is not None:
            self._no_head.cancel()
            self._no_head = None
