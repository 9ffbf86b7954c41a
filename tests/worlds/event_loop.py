"""The event loop of tests. It closes a connection that it accepted in the very turn in which the test ended.

asyncio's own loop (3.11 to 3.13) hands an accepted socket to a task. If the loop ends before the task's first step, the
socket is left to the garbage collector, whose ResourceWarning then fails some later test: rare, and likelier on a busy
machine.
"""

from __future__ import annotations

import asyncio
from socket import socket
from typing import Any


class LoopOfTests(asyncio.SelectorEventLoop):
    def _accept_connection2(self, protocol_factory: Any, conn: socket, *others: Any, **named: Any) -> Any:
        accepting = super()._accept_connection2(protocol_factory, conn, *others, **named)  # type: ignore[misc]
        task = self.create_task(accepting)

        def close_if_it_never_began(accepted: asyncio.Task[Any]) -> None:
            if accepted.cancelled():
                conn.close()

        task.add_done_callback(close_if_it_never_began)
        return _nothing()


async def _nothing() -> None:
    """asyncio makes a task of what `_accept_connection2` returns."""


class LoopsOfTests(asyncio.DefaultEventLoopPolicy):
    def new_event_loop(self) -> asyncio.AbstractEventLoop:
        return LoopOfTests()
