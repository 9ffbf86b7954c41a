"""The tower's UDP socket, the thin shell of the data channel: hands datagrams to the hub, counts what it refuses."""

import asyncio
import time
from typing import Any, cast

import structlog

from server.relay.hub import Hub
from wire.drops import Dropped
from wire.sealing import read_link_id

_log = structlog.get_logger(__name__)


class DataEndpoint(asyncio.DatagramProtocol):
    """One socket for all agents. Never answers a datagram that has not been authenticated."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.DatagramTransport", transport)

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        try:
            self._hub.datagram(data, read_link_id(data), (addr[0], addr[1]), time.monotonic())
        except Dropped as dropped:
            self._hub.drops[dropped.reason] += 1

    def error_received(self, exc: Exception) -> None:
        # An ICMP answer to a datagram of ours: the agent is gone, which the keep-alive finds out by itself.
        pass

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        """Sends at once; what the kernel cannot take is lost, as on any network."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.sendto(datagram, address)
            traffic = self._hub.traffic
            traffic.datagrams_to_agents += 1
            traffic.bytes_to_agents += len(datagram)

    @property
    def port(self) -> int:
        """The port that the kernel gave us."""
        assert self._transport is not None
        return cast("int", self._transport.get_extra_info("sockname")[1])

    def close(self) -> None:
        """Closes the socket."""
        if self._transport is not None:
            self._transport.close()


async def open_data_endpoint(hub: Hub, host: str, port: int) -> DataEndpoint:
    """Binds the data channel's socket (port 0: the kernel picks one). Raises OSError if the port is in use."""
    _, endpoint = await asyncio.get_running_loop().create_datagram_endpoint(
        lambda: DataEndpoint(hub), local_addr=(host, port)
    )
    _log.info("data_channel_open", host=host, port=endpoint.port)
    return endpoint
