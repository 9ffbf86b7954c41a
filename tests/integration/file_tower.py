"""A proxy before the fake tower: receives the files that an agent sends, and forwards everything else."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import AsyncIterator

from agent_fakes import TICKET

REFUSAL = b'{"type": "about:blank", "title": "Too large", "detail": "The tower has no room for it."}'


class FileTower:
    """`answers`: statuses for the next files, then 201. 0: reads nothing and sends no response."""

    def __init__(self, behind_port: int = 0) -> None:
        self.answers: list[int] = []
        self.files: list[tuple[str, bytes]] = []
        """Path and bytes of each received file, whatever the response."""
        self.stuck = 0
        """Number of files left unread in their sockets."""
        self.port = 0
        self._behind_port = behind_port
        self._tasks: set[asyncio.Task[None]] = set()

    @contextlib.asynccontextmanager
    async def running(self, secure: ssl.SSLContext | None = None) -> AsyncIterator[FileTower]:
        server = await asyncio.start_server(self._serve, "127.0.0.1", 0, ssl=secure)
        self.port = server.sockets[0].getsockname()[1]
        try:
            yield self
        finally:
            server.close()
            for task in self._tasks:
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        with contextlib.suppress(OSError, asyncio.IncompleteReadError, asyncio.CancelledError):
            head = await reader.readuntil(b"\r\n\r\n")
            if head.startswith(b"PUT "):
                await self._take(head, reader, writer)
            else:
                await self._hand_on(head, reader, writer)
        writer.close()

    async def _take(self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        request, *lines = head.decode().rstrip().split("\r\n")
        headers = {name.lower(): value for name, _, value in (line.partition(": ") for line in lines)}
        status = self.answers.pop(0) if self.answers else 201
        if status == 0:
            self.stuck += 1
            await asyncio.Event().wait()
        body = b"" if headers.get("authorization") == f"Bearer {TICKET}" else None
        if body is not None:
            body = await reader.readexactly(int(headers["content-length"]))
            self.files.append((request.split()[1], body))
        said = REFUSAL if status >= 400 else b""
        writer.write(
            f"HTTP/1.1 {401 if body is None else status} X\r\nContent-Length: {len(said)}\r\n\r\n".encode() + said
        )
        await writer.drain()

    async def _hand_on(self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        behind_reader, behind_writer = await asyncio.open_connection("127.0.0.1", self._behind_port)
        behind_writer.write(head)
        try:
            await asyncio.wait(
                [
                    asyncio.create_task(_pour(reader, behind_writer)),
                    asyncio.create_task(_pour(behind_reader, writer)),
                ],
                return_when=asyncio.FIRST_COMPLETED,
            )
        finally:
            behind_writer.close()


async def _pour(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(65536):
            writer.write(data)
            await writer.drain()
