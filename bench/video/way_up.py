"""How the drone's uplink treats small datagrams: stamped datagrams from the drone to the tower."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import AsyncIterator
from struct import Struct
from typing import Final

from bench.link_model import BUFFER_S
from bench.namespaces import Network

EVERY_S: Final = 0.05
_STAMP: Final = Struct("<d")
_PADDING: Final = b"\0" * 60
"""As long as a sealed frame of telemetry."""


class WayUp:
    """Milliseconds of each datagram that arrived, and how many were sent."""

    def __init__(self, network: Network) -> None:
        with network.inside("tower"):
            self._ear = _socket(network.address("tower"))
        with network.inside("drone"):
            self._mouth = _socket(network.address("drone"))
        self._mouth.connect(self._ear.getsockname())
        self.took_ms: list[float] = []
        self.sent = 0
        asyncio.get_running_loop().add_reader(self._ear, self._hear)
        self._speaking = asyncio.create_task(self._speak())

    async def _speak(self) -> None:
        while True:
            with contextlib.suppress(OSError):
                self._mouth.send(_STAMP.pack(time.monotonic()) + _PADDING)
                self.sent += 1
            await asyncio.sleep(EVERY_S)

    async def rest(self) -> None:
        """Stops sending; waits for datagrams in transit, even from a full queue."""
        self._speaking.cancel()
        await asyncio.sleep(BUFFER_S + 0.5)

    def _hear(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                (sent_at,) = _STAMP.unpack_from(self._ear.recv(2048))
                self.took_ms.append((time.monotonic() - sent_at) * 1e3)

    def close(self) -> None:
        self._speaking.cancel()
        asyncio.get_running_loop().remove_reader(self._ear)
        self._ear.close()
        self._mouth.close()


def _socket(address: str) -> socket.socket:
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    one.setblocking(False)
    one.bind((address, 0))
    return one


@contextlib.asynccontextmanager
async def way_up(network: Network) -> AsyncIterator[WayUp]:
    """Runs until the block ends."""
    probe = WayUp(network)
    try:
        yield probe
    finally:
        probe.close()
