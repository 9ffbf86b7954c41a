"""The UDP socket of one link. A thin shell: bytes in, bytes out, and a new source port when asked."""

import asyncio
from collections.abc import Callable
from typing import Any


class DataSocket:
    """Connected to the tower's UDP address, so that the kernel already drops what others send."""

    def __init__(self, received: Callable[[bytes], None]) -> None:
        self._received = received
        self._transport: asyncio.DatagramTransport | None = None

    async def open(self, host: str, port: int) -> None:
        """Opens, or opens anew from another source port. Raises OSError, and then the old one is still in use."""
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(lambda: _Inbox(self._received), remote_addr=(host, port))
        self.close()
        self._transport = transport

    def send(self, datagram: bytes) -> None:
        """Sends at once; what the network cannot take is lost, as anything on UDP may be."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.sendto(datagram)

    def close(self) -> None:
        """Closes the socket, if open."""
        if self._transport is not None:
            self._transport.close()
            self._transport = None


class _Inbox(asyncio.DatagramProtocol):
    """Errors (an ICMP refusal while the tower restarts) are no news: the keep-alive tells."""

    def __init__(self, received: Callable[[bytes], None]) -> None:
        self._received = received

    def datagram_received(self, data: bytes, addr: Any) -> None:
        self._received(data)
