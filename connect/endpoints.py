"""Local endpoints for programs: UDP to a known address, UDP on a port, TCP on a port. Thin shells."""

import asyncio
import errno
import socket
from collections.abc import Callable, Hashable
from typing import Any, Final, Protocol

from connect.unusable import Unusable

Received = Callable[[Hashable, bytes], None]
Gone = Callable[[Hashable], None]

PEER_FORGOTTEN_AFTER_S: Final = 30.0
MAX_PEERS: Final = 16
"""Programs on one UDP port. More are not served until one falls silent."""

MAGICS: Final = frozenset({0xFD, 0xFE})
"""The first byte of a MAVLink program: a frame of version 2 or 1."""

MAX_UNREAD_BYTES: Final = 1 << 20
"""A TCP program with more unread bytes is disconnected: half a minute of telemetry."""


class Endpoint(Protocol):
    """`name` is for people: transport and address."""

    @property
    def name(self) -> str: ...

    async def open(self, received: Received, gone: Gone) -> None:
        """Raises Unusable if the address is not available."""

    def send(self, frames: list[bytes]) -> None:
        """Sends to every program here, at once or never."""

    def close(self) -> None: ...


def _unusable(name: str, error: OSError) -> Unusable:
    if error.errno == errno.EADDRINUSE:
        return Unusable(f"{name} is in use by another program: choose another port")
    return Unusable(f"{name} cannot be opened: {error.strerror or error}")


class UdpTo:
    """Sends to one address from its own port, as autopilots do; receives from that address only."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"udp {host}:{port}"
        self._address = (host, port)
        self._transport: asyncio.DatagramTransport | None = None

    async def open(self, received: Received, gone: Gone) -> None:
        loop = asyncio.get_running_loop()
        try:
            self._transport, _ = await loop.create_datagram_endpoint(
                lambda: _Datagrams(lambda data, _: received(self.name, data)), remote_addr=self._address
            )
        except OSError as error:
            raise _unusable(self.name, error) from None

    def send(self, frames: list[bytes]) -> None:
        assert self._transport is not None
        for frame in frames:
            self._transport.sendto(frame)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()


class UdpOn:
    """Waits on a port; sends to the programs that have sent something recently."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"udp {host}:{port}"
        self._host, self._port = host, port
        self._peers: dict[Any, float] = {}
        self._transport: asyncio.DatagramTransport | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    async def open(self, received: Received, gone: Gone) -> None:
        self._loop = loop = asyncio.get_running_loop()

        def heard(data: bytes, address: Any) -> None:
            if self._admit(address):
                received(address, data)

        sock = socket.socket(socket.AF_INET6 if ":" in self._host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.setblocking(False)
            sock.bind((self._host, self._port))  # here, because not every event loop reports why bind failed
        except OSError as error:
            sock.close()
            raise _unusable(self.name, error) from None
        self._transport, _ = await loop.create_datagram_endpoint(lambda: _Datagrams(heard), sock=sock)
        self.name = f"udp {self._host}:{sock.getsockname()[1]}"

    def _admit(self, address: Any) -> bool:
        assert self._loop is not None
        now = self._loop.time()
        if address not in self._peers:
            silent = [one for one, at in self._peers.items() if now - at > PEER_FORGOTTEN_AFTER_S]
            for one in silent:
                del self._peers[one]
            if len(self._peers) >= MAX_PEERS:
                return False
        self._peers[address] = now
        return True

    def send(self, frames: list[bytes]) -> None:
        assert self._transport is not None
        for address in self._peers:
            for frame in frames:
                self._transport.sendto(frame, address)

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()


class TcpOn:
    """Waits on a port for any number of programs."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"tcp {host}:{port}"
        self._host, self._port = host, port
        self._server: asyncio.Server | None = None
        self._writers: set[asyncio.StreamWriter] = set()

    async def open(self, received: Received, gone: Gone) -> None:
        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            self._writers.add(writer)
            is_known = False
            try:
                while data := await reader.read(16384):
                    if not is_known and data[0] not in MAGICS:
                        return  # for example a web page: it may send to local ports, even MAVLink frames in its request
                    is_known = True
                    received(writer, data)
            except OSError:
                pass  # the program has closed the connection
            finally:
                self._writers.discard(writer)
                gone(writer)
                writer.close()

        try:
            self._server = await asyncio.start_server(serve, self._host, self._port)
        except OSError as error:
            raise _unusable(self.name, error) from None
        self.name = f"tcp {self._host}:{self._server.sockets[0].getsockname()[1]}"

    def send(self, frames: list[bytes]) -> None:
        data = b"".join(frames)
        for writer in list(self._writers):
            if writer.transport.get_write_buffer_size() > MAX_UNREAD_BYTES:
                writer.transport.abort()
            else:
                writer.write(data)

    def close(self) -> None:
        for writer in list(self._writers):
            writer.close()
        if self._server is not None:
            self._server.close()


class _Datagrams(asyncio.DatagramProtocol):
    """A missing program is not an error: a frame sent before it starts is lost."""

    def __init__(self, received: Callable[[bytes, Any], None]) -> None:
        self._received = received

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._received(data, addr)
