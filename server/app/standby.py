"""The responses of a tower that waits for another one to end: it reports only that it stands by, to few clients at a
time.

It reads one request of a connection and closes it. It opens the parts of the tower only once it becomes the tower.
"""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Final

HEALTH: Final = "/api/v1/health"
MAX_HEAD_BYTES: Final = 8 * 1024
MAX_CONNECTIONS: Final = 64
REQUEST_WITHIN_S: Final = 5.0
_WORDS: Final = "another process is the tower; this one takes its place when it ends"


@asynccontextmanager
async def answering_standby(listener: socket.socket, version: str) -> AsyncIterator[None]:
    """Answers on the socket until the block ends, and leaves it open: later connections wait in its queue."""
    open_now: set[asyncio.Task[None]] = set()

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        try:
            if len(open_now) < MAX_CONNECTIONS:
                open_now.add(task)
                async with asyncio.timeout(REQUEST_WITHIN_S):
                    head = await reader.readuntil(b"\r\n\r\n")
                    writer.write(_answer(head, version))
                    await writer.drain()
        except (OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass  # a client that sends nothing, sends too much, or disconnects
        finally:
            open_now.discard(task)
            writer.close()

    server = await asyncio.start_server(answer, sock=listener.dup(), limit=MAX_HEAD_BYTES)
    try:
        yield
    finally:
        server.close()
        for task in list(open_now):
            task.cancel()
        with suppress(TimeoutError):
            async with asyncio.timeout(1.0):
                await asyncio.gather(*open_now, return_exceptions=True)


def _answer(head: bytes, version: str) -> bytes:
    path = head.split(b" ", 2)[1].split(b"?")[0].decode("latin-1") if head.count(b" ") > 1 else ""
    if path == HEALTH:
        return _http("200 OK", "application/json", {"status": "standby", "version": version})
    problem = {"type": "/problems/standby", "title": "This tower stands by", "status": 503, "detail": _WORDS}
    return _http("503 Service Unavailable", "application/problem+json", problem)


def _http(status: str, kind: str, document: dict[str, object]) -> bytes:
    body = json.dumps(document).encode()
    head = (
        f"HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n"
        "Retry-After: 1\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n"
    )
    return head.encode() + body
