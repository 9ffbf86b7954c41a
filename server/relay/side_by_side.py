"""Runs the parts of one connection side by side until the first of them ends, then ends them all."""

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect


async def until_one_ends(*parts: Coroutine[Any, Any, None]) -> None:
    """Raises what a part raised, once all have ended; a part that was cancelled for another's sake raises nothing."""
    tasks = [asyncio.create_task(part) for part in parts]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        ended = await asyncio.gather(*tasks, return_exceptions=True)
    for error in ended:
        if isinstance(error, Exception):
            raise error


class Ending:
    """A wish to end a connection, with a code and a reason; the first one counts."""

    def __init__(self) -> None:
        self._wished = asyncio.Event()
        self.code = 0
        self.why = ""

    @property
    def wished(self) -> bool:
        """Whether anybody wants the connection to end."""
        return self._wished.is_set()

    def wish(self, code: int, why: str) -> None:
        """Asks for the end. `why` is for people and is cut to what a close frame can carry."""
        if not self.wished:
            self.code, self.why = code, why[:100]
            self._wished.set()

    async def wait(self) -> None:
        """Returns when the end is wished."""
        await self._wished.wait()


async def close_quietly(websocket: WebSocket, code: int, why: str) -> None:
    """Says good-bye to a peer that may be gone or may not read any more."""
    with contextlib.suppress(RuntimeError, TimeoutError, WebSocketDisconnect):
        await asyncio.wait_for(websocket.close(code, why[:100]), 1.0)
