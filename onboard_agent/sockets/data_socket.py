"""One UDP socket of a link: one uplink. A thin shell: bytes in, bytes out, and a new source port on request."""

import asyncio
import contextlib
import ipaddress
import socket
from collections.abc import Callable
from typing import Any, Final

from onboard_agent.sockets.priorities import goes_first

ANY_UPLINK: Final = ""
"""The kernel's routes decide."""

_DONT_FRAGMENT: Final = {
    # (level, option, value that sets "do not fragment" regardless of the kernel's path MTU, value that does not)
    socket.AF_INET: (socket.IPPROTO_IP, 10, 3, 0),
    socket.AF_INET6: (socket.IPPROTO_IPV6, 23, 3, 0),
}
"""IP_MTU_DISCOVER and IPV6_MTU_DISCOVER of Linux: IP_PMTUDISC_PROBE and IP_PMTUDISC_DONT."""


class DataSocket:
    """Connected to the tower's UDP address, so that the kernel drops packets from other senders.

    `uplink`: the name of a network interface, or a local address, or ANY_UPLINK.
    """

    def __init__(self, received: Callable[[bytes], None], uplink: str = ANY_UPLINK) -> None:
        self.uplink = uplink
        self._received = received
        self._socket: socket.socket | None = None
        self._transport: asyncio.DatagramTransport | None = None

    @property
    def is_open(self) -> bool:
        return self._transport is not None

    @property
    def local_address(self) -> str | None:
        """This machine's address on this uplink; None while it is not open."""
        return None if self._socket is None else str(self._socket.getsockname()[0])

    async def open(self, host: str, port: int) -> None:
        """Opens, or reopens with another source port. Raises OSError, and then the old socket stays in use."""
        opened = bound_socket(host, port, self.uplink)
        try:
            transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
                lambda: _Inbox(self._received), sock=opened
            )
        except BaseException:
            opened.close()
            raise
        self.close()
        self._socket, self._transport = opened, transport

    def send(self, datagram: bytes) -> None:
        """Sends at once. A datagram that the network cannot take is lost, as any UDP datagram may be."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.sendto(datagram)

    def send_whole(self, datagram: bytes) -> None:
        """Like `send`, but never fragments: a datagram that does not fit is lost. Used to probe the path's MTU."""
        if self._socket is None:
            return
        level, option, whole, cut = _DONT_FRAGMENT[self._socket.family]
        with contextlib.suppress(OSError):
            self._socket.setsockopt(level, option, whole)
            self.send(datagram)
            self._socket.setsockopt(level, option, cut)

    def close(self) -> None:
        """Closes the socket, if open."""
        if self._transport is not None:
            self._transport.close()
            self._transport = self._socket = None


def bound_socket(host: str, port: int, uplink: str) -> socket.socket:
    """Returns a UDP socket over `uplink`, connected to (host, port); `host` is an IP address. Raises OSError."""
    address = ipaddress.ip_address(host)
    opened = socket.socket(socket.AF_INET6 if address.version == 6 else socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.setblocking(False)
        goes_first(opened)
        if uplink:
            bind_to_uplink(opened, uplink)
        opened.connect((host, port))
    except BaseException:
        opened.close()
        raise
    return opened


def bind_to_uplink(opened: socket.socket, uplink: str) -> None:
    """Binds the socket to `uplink`, an interface or a local address. Raises OSError."""
    try:
        ipaddress.ip_address(uplink)
    except ValueError:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, uplink.encode())
    else:
        opened.bind((uplink, 0))


class _Inbox(asyncio.DatagramProtocol):
    """Ignores errors (an ICMP refusal while the tower restarts), because the keep-alive detects them."""

    def __init__(self, received: Callable[[bytes], None]) -> None:
        self._received = received

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._received(data)
