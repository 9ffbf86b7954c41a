"""How a vehicle's bytes leave the process: one UDP socket or TCP connection for each vehicle.

UDP sockets that send first are connected, so the kernel drops packets of all but the peer.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, cast

RECONNECT_S = 1.0
UNSENT_MAX = 256 * 1024
"""Bytes queued for a slow TCP peer; beyond it frames are dropped, as on a full radio link."""

Receive = Callable[[bytes], None]


@dataclass(frozen=True, slots=True)
class Endpoint:
    scheme: str
    host: str
    port: int

    def moved(self, by: int) -> Endpoint:
        return Endpoint(self.scheme, self.host, self.port + by)

    def __str__(self) -> str:
        return f"{self.scheme}:{self.host}:{self.port}"


def parse_endpoint(text: str) -> Endpoint:
    """Parses `udp:HOST:PORT` (sends first), `udpin:HOST:PORT` (waits for a peer), and the same for `tcp` and
    `tcpin`."""
    scheme, _, rest = text.partition(":")
    host, _, port = rest.rpartition(":")
    if scheme not in OPENERS or not host or not port.isdecimal() or not 0 < int(port) < 65536:
        raise ValueError(f"{text!r} is none of {', '.join(f'{s}:HOST:PORT' for s in OPENERS)}")
    return Endpoint(scheme, host.strip("[]"), int(port))


class Link(Protocol):
    def send(self, frames: list[bytes]) -> None: ...

    def close(self) -> None: ...


class UdpLink(asyncio.DatagramProtocol):
    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.DatagramTransport, transport)  # uvloop's transport has no base class

    def datagram_received(self, data: bytes, addr: object) -> None:
        del addr
        self._receive(data)

    def error_received(self, exc: Exception) -> None:
        """No listener (yet): an autopilot continues to send."""

    def send(self, frames: list[bytes]) -> None:
        if self._transport is not None:
            for frame in frames:
                self._transport.sendto(frame)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()


class UdpInLink(UdpLink):
    """Bound to an address; sends to the last sender, as an autopilot's network port does."""

    def __init__(self, receive: Receive) -> None:
        super().__init__(receive)
        self._peer: tuple[str, int] | None = None

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:  # type: ignore[override]
        self._peer = addr
        self._receive(data)

    def send(self, frames: list[bytes]) -> None:
        if self._transport is not None and self._peer is not None:
            for frame in frames:
                self._transport.sendto(frame, self._peer)


class TcpLink(asyncio.Protocol):
    """One stream at a time; a newer connection replaces the older."""

    def __init__(self, receive: Receive) -> None:
        self._receive = receive
        self._transport: asyncio.Transport | None = None
        self._server: asyncio.Server | None = None
        self._reconnect: asyncio.Task[None] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if self._transport is not None:
            self._transport.abort()
        self._transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        self._receive(data)

    def connection_lost(self, exc: Exception | None) -> None:
        if self._transport is not None and self._transport.is_closing():
            self._transport = None

    def send(self, frames: list[bytes]) -> None:
        transport = self._transport
        if transport is not None and transport.get_write_buffer_size() < UNSENT_MAX:
            transport.write(b"".join(frames))

    def close(self) -> None:
        if self._reconnect is not None:
            self._reconnect.cancel()
        if self._server is not None:
            self._server.close()
        if self._transport is not None:
            self._transport.abort()

    async def listen(self, endpoint: Endpoint) -> None:
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: self, endpoint.host, endpoint.port)

    def keep_connected(self, endpoint: Endpoint) -> None:
        self._reconnect = asyncio.get_running_loop().create_task(self._connect_for_ever(endpoint))

    async def _connect_for_ever(self, endpoint: Endpoint) -> None:
        loop = asyncio.get_running_loop()
        while True:
            if self._transport is None:
                try:
                    await loop.create_connection(lambda: self, endpoint.host, endpoint.port)
                except OSError:
                    self._transport = None
            await asyncio.sleep(RECONNECT_S)


async def _open_udp(endpoint: Endpoint, receive: Receive) -> Link:
    loop = asyncio.get_running_loop()
    _, link = await loop.create_datagram_endpoint(lambda: UdpLink(receive), remote_addr=(endpoint.host, endpoint.port))
    return link


async def _open_udpin(endpoint: Endpoint, receive: Receive) -> Link:
    loop = asyncio.get_running_loop()
    address = (endpoint.host, endpoint.port)
    _, link = await loop.create_datagram_endpoint(lambda: UdpInLink(receive), local_addr=address)
    return link


async def _open_tcp(endpoint: Endpoint, receive: Receive) -> Link:
    link = TcpLink(receive)
    link.keep_connected(endpoint)
    return link


async def _open_tcpin(endpoint: Endpoint, receive: Receive) -> Link:
    link = TcpLink(receive)
    await link.listen(endpoint)
    return link


OPENERS = {"udp": _open_udp, "udpin": _open_udpin, "tcp": _open_tcp, "tcpin": _open_tcpin}


async def open_link(endpoint: Endpoint, receive: Receive) -> Link:
    return await OPENERS[endpoint.scheme](endpoint, receive)
