"""A file transfer over the drone's uplink as fast as TCP permits, by an unrelated program."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator
from typing import Final

from bench.namespaces import Network

_PIECE: Final = bytes(16 * 1024)


@contextlib.asynccontextmanager
async def bulk_up(network: Network) -> AsyncIterator[None]:
    """Runs until the block ends."""
    loop = asyncio.get_running_loop()
    with contextlib.ExitStack() as stack:
        with network.inside("tower"):
            door = stack.enter_context(socket.create_server((network.address("tower"), 0)))
        with network.inside("drone"):
            mouth = stack.enter_context(socket.socket())
        door.setblocking(False)
        mouth.setblocking(False)
        await loop.sock_connect(mouth, door.getsockname())
        ear, _ = await loop.sock_accept(door)
        stack.enter_context(ear)
        tasks = [asyncio.create_task(_swallow(ear)), asyncio.create_task(_pour(mouth))]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


async def _pour(mouth: socket.socket) -> None:
    while True:
        await asyncio.get_running_loop().sock_sendall(mouth, _PIECE)


async def _swallow(ear: socket.socket) -> None:
    while await asyncio.get_running_loop().sock_recv(ear, 1 << 16):
        pass
