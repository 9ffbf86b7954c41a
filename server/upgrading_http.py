"""uvicorn's HTTP, with a bound where it has none, and without what would stay behind when a WebSocket begins.

- Who connects and says nothing, or one byte now and then, would keep the connection for ever, and thousands of them
  all that the process may open: the head of a request must be there within HEAD_WITHIN_S. (Between requests, uvicorn
  waits for 5 s.)
- The parser and the connection know each other. At the end uvicorn parts them; one that was upgraded has no such end,
  and both would wait for the garbage collector, which comes seldom (server/garbage.py), with all that was in the
  request.
"""

import asyncio
from typing import Any, Final

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

HEAD_WITHIN_S: Final = 10.0
"""A browser opens connections ahead of time; one that is closed is opened anew when it is needed."""


class UpgradingHttp(HttpToolsProtocol):
    """What `TowerServer` gives to uvicorn as its HTTP implementation."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._no_head: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._wait_for_head()

    def connection_lost(self, exc: Exception | None) -> None:
        self._head_is_there()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        # Line ends between requests begin none, but they have stopped uvicorn's own timer.
        idle = self.cycle is None or self.cycle.response_complete
        if idle and self._no_head is None and self.timeout_keep_alive_task is None and self.parser is not None:
            self._wait_for_head()

    def on_message_begin(self) -> None:
        super().on_message_begin()
        if self._no_head is None:
            self._wait_for_head()

    def on_headers_complete(self) -> None:
        self._head_is_there()
        super().on_headers_complete()

    def handle_websocket_upgrade(self) -> None:
        super().handle_websocket_upgrade()
        # From here on everything that comes goes to the WebSocket.
        self.parser = None  # type: ignore[assignment]

    def _wait_for_head(self) -> None:
        self._no_head = self.loop.call_later(HEAD_WITHIN_S, self.transport.abort)

    def _head_is_there(self) -> None:
        if self._no_head is not None:
            self._no_head.cancel()
            self._no_head = None
