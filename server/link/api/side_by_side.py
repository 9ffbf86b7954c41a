"""Runs the parts of one connection side by side until the first of them ends, then ends them all."""

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Any, Final

from starlette.websockets import WebSocket, WebSocketDisconnect

MAX_REASON_BYTES: Final = 123
"""RFC 6455, 5.5: a control frame has at most 125 bytes, two of them for the code."""

GOOD_BYE_WITHIN_S: Final = 1.0

_BREACHES: Final = (1002, 1007, 1009)
"""Codes with which the WebSocket library itself closes a connection: protocol error, invalid UTF-8, too large."""


async def until_one_ends(*parts: Coroutine[Any, Any, None]) -> None:
    """Raises what a part raised, once all have ended; a part that was cancelled because another ended raises
    nothing."""
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
    """A request to end a connection, with a code and a reason for people; the first one counts."""

    def __init__(self) -> None:
        self._requested = asyncio.Event()
        self.code = 0
        self.why = ""

    @property
    def requested(self) -> bool:
        """Whether an end was requested."""
        return self._requested.is_set()

    def request(self, code: int, why: str) -> None:
        """Requests the end."""
        if not self.requested:
            self.code, self.why = code, why
            self._requested.set()

    async def wait(self) -> None:
        """Returns when the end is requested."""
        await self._requested.wait()


async def close_quietly(websocket: WebSocket, code: int, why: str) -> None:
    """Closes the connection to a peer that may be gone or may no longer read."""
    with contextlib.suppress(RuntimeError, TimeoutError, WebSocketDisconnect):
        async with asyncio.timeout(GOOD_BYE_WITHIN_S):
            await websocket.close(code, cut_reason(why))


def cut_reason(why: str) -> str:
    """Returns as much of it as fits into a close frame: its limit is in bytes, and the text may quote a message."""
    return why.encode(errors="replace")[:MAX_REASON_BYTES].decode(errors="ignore")


def is_breach(code: int) -> bool:
    """Whether the connection ended because of invalid data from the peer, before our code saw it."""
    return code in _BREACHES
