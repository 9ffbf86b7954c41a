"""A webhook for the tests: keeps what it is told about alerts."""

import asyncio
import json
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, Final

CHANNELS: Final = "/api/v1/me/alert-channels"


class Inbox:
    """Listens on a loopback port that the kernel picks."""

    def __init__(self) -> None:
        self.told: list[str] = []
        self.port = 0

    async def call(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = (await reader.readuntil(b"\r\n\r\n")).decode()
        length = re.search(r"(?im)^content-length: (\d+)\r$", head)
        assert length is not None
        body = json.loads(await reader.readexactly(int(length[1])))
        self.told.append(f"{body['happening']} {body['rule']} {body['id']}")
        writer.write(b"HTTP/1.1 204 kept\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
        writer.close()

    def of(self, rule: str) -> list[str]:
        """What happened to alerts by this rule, in order."""
        return [one.split()[0] for one in self.told if one.split()[1] == rule]

    @asynccontextmanager
    async def listening(self) -> AsyncIterator["Inbox"]:
        async with await asyncio.start_server(self.call, "127.0.0.1", 0) as server:
            self.port = server.sockets[0].getsockname()[1]
            yield self

    @property
    def channel(self) -> dict[str, Any]:
        """The body that adds it to a user's channels."""
        return {"kind": "webhook", "target": f"http://127.0.0.1:{self.port}/", "severity": "notice"}
