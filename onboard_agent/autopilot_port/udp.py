"""The autopilot over UDP: `udpin` waits for it on a port, `udpout` sends to a known address."""

import asyncio
import contextlib
import errno
import logging
import socket
from collections.abc import Awaitable, Callable
from typing import Any, Final

from onboard_agent.autopilot_port.peer import PeerChoice
from onboard_agent.autopilot_port.port import AutopilotPort, OnBytes
from onboard_agent.link.backoff import Backoff
from onboard_agent.unusable import Unusable

_log = logging.getLogger(__name__)

_NOT_CURED_BY_TIME: Final = (errno.EACCES, errno.EPERM, errno.EAFNOSUPPORT, socket.EAI_NONAME)


RECEIVE_BUFFER_BYTES: Final = 1 << 20
"""Room for a list of 1,400 parameters, in the kernel's accounting, while this process does not run for a moment. The
default buffer holds 270 packets of any size. The kernel limits the size to its maximum."""


def _widen(sock: socket.socket) -> None:
    with contextlib.suppress(OSError):
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)


class _Packets(asyncio.DatagramProtocol):
    """Passes packets on, and ignores all other events of a UDP socket."""

    def __init__(self, port: "UdpIn | UdpOut", received: OnBytes) -> None:
        self._port = port
        self._received = received

    def datagram_received(self, data: bytes, addr: Any) -> None:
        if self._port.is_from_autopilot(data, addr):
            self._received(data)


async def _until_open(
    port: "UdpIn | UdpOut", opening: Callable[[], Awaitable[asyncio.DatagramTransport]]
) -> asyncio.DatagramTransport:
    """Returns the socket. Waits for networks and names that are missing, as right after boot. Raises Unusable."""
    backoff = Backoff()
    is_logged = False
    while True:
        try:
            return await opening()
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise Unusable(f"{port.name}: this UDP port is used by another program") from None
            if error.errno in _NOT_CURED_BY_TIME:
                raise Unusable(f"{port.name}: cannot be opened: {error.strerror}") from None
            if not is_logged:
                _log.error("%s: cannot be opened yet (%s); trying on", port.name, error.strerror or error)
                is_logged = True
        await asyncio.sleep(backoff.next_delay_s())


class UdpIn(AutopilotPort):
    """Bound to an address; replies to the one autopilot that sends to it."""

    def __init__(self, name: str, host: str, port: int) -> None:
        super().__init__(name)
        self._host = host
        self._port = port
        self._peer = PeerChoice()
        self._transport: asyncio.DatagramTransport | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def bound_port(self) -> int:
        """The port in use: for port 0 the one that the kernel selected; 0 while closed."""
        if self._transport is None:
            return 0
        return int(self._transport.get_extra_info("sockname")[1])

    async def run(self, received: OnBytes) -> None:
        self._loop = asyncio.get_running_loop()
        self._transport = await _until_open(self, lambda: self._bind(received))
        self.on_open()
        try:
            await asyncio.Event().wait()
        finally:
            self._transport.close()
            self._transport = None

    async def _bind(self, received: OnBytes) -> asyncio.DatagramTransport:
        loop = asyncio.get_running_loop()
        found = await loop.getaddrinfo(self._host, self._port, type=socket.SOCK_DGRAM)
        family, kind, protocol, _, address = found[0]
        sock = socket.socket(family, kind, protocol)
        try:
            sock.setblocking(False)
            _widen(sock)
            sock.bind(address)  # here, because not every event loop reports why it failed
        except OSError:
            sock.close()
            raise
        transport, _ = await loop.create_datagram_endpoint(lambda: _Packets(self, received), sock=sock)
        return transport

    def is_from_autopilot(self, data: bytes, addr: Any) -> bool:
        """Whether a packet is from the autopilot. Learns where to send."""
        assert self._loop is not None
        before = self._peer.address
        if not self._peer.accepts((addr[0], addr[1]), data, self._loop.time()):
            self.counts["from another peer"] += 1
            return False
        if self._peer.address != before:
            self.on_open()
        return True

    def send(self, data: bytes) -> None:
        if self._transport is None or self._peer.address is None:
            self.counts["autopilot not there"] += 1
            return
        self._transport.sendto(data, self._peer.address)


class UdpOut(AutopilotPort):
    """Connected to the autopilot's address; receives from no other. The first packet shows it the agent's address."""

    speaks_first = True

    def __init__(self, name: str, host: str, port: int) -> None:
        super().__init__(name)
        self._host = host
        self._port = port
        self._transport: asyncio.DatagramTransport | None = None

    async def run(self, received: OnBytes) -> None:
        self._transport = await _until_open(self, lambda: self._connect(received))
        self.on_open()
        try:
            await asyncio.Event().wait()
        finally:
            self._transport.close()
            self._transport = None

    async def _connect(self, received: OnBytes) -> asyncio.DatagramTransport:
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
            lambda: _Packets(self, received), remote_addr=(self._host, self._port)
        )
        _widen(transport.get_extra_info("socket"))
        return transport

    def is_from_autopilot(self, data: bytes, addr: Any) -> bool:
        """Always True: the kernel passes only packets from the connected peer."""
        return True

    def send(self, data: bytes) -> None:
        if self._transport is None:
            self.counts["autopilot not there"] += 1
            return
        self._transport.sendto(data)
