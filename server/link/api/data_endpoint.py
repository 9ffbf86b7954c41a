"""The tower's UDP socket, a thin layer of the data channel: passes datagrams to the hub, counts those it refuses.

A plain socket: with 50 drones at 500 to 2,500 datagrams a second it costs a quarter to a third less than uvloop's own
datagram transport, and the same on a loop that has none. A single datagram is read at once. Datagrams that arrive in
quick succession are read in rounds (`read_pacer`), because waking the process costs more than ten datagrams in a
process that is awake. Drones that are flown by hand or watched closely are in no round: each has a socket of its own
(`connected_sockets`).
"""

import asyncio
import contextlib
import socket
import time
from collections.abc import Callable, Set
from typing import Final, cast

import structlog

from server.anonymous.core.budget import AnonymousBudget, Over
from server.link.api.connected_sockets import ConnectedSockets
from server.link.api.read_gate import ReadGate
from server.link.api.write_round import WriteRound
from server.link.core.read_pacer import ReadPacer
from server.live.hub import Hub
from wire.drops import Dropped, DropReason
from wire.ids import LinkId

_log = structlog.get_logger(__name__)

MAX_CONCURRENT: Final = 64
"""Datagrams read before other work gets a turn: browsers' sticks must not wait for a flood to end."""

JUNK_BESIDE: Final = 8
"""Multiple of that, used while most datagrams belong to no link and are only counted: otherwise junk would fill the
kernel's buffer and displace the agents' datagrams."""

SLICE_S: Final = 0.002
CHECK_EVERY: Final = 32
"""After so many datagrams a round checks the clock. A round longer than SLICE_S pauses to give other work a turn:
sockets of drones flown by hand, and sticks."""

RECEIVE_BUFFER_BYTES: Final = 4 << 20
"""Requested size; the kernel grants what it allows. Datagrams that arrive while the tower is busy wait there."""

_ROOM_BYTES: Final = 2048
"""More than the largest datagram: a longer one is truncated, and refused for its length."""


class DataEndpoint:
    """One socket for all agents. Never answers a datagram that has not been authenticated."""

    def __init__(self, hub: Hub, anonymous: AnonymousBudget | None = None) -> None:
        self._hub = hub
        self._anonymous = anonymous
        self.write_round = WriteRound()
        self.may_act: Callable[[], bool] = lambda: True
        """Called before anything is sent to an agent: false in a process that may no longer be the tower."""
        self._socket: socket.socket | None = None
        self._pacer = ReadPacer()
        self._resting: asyncio.TimerHandle | None = None
        self._gate: ReadGate | None = None
        self._connected: ConnectedSockets | None = None

    def listen_on(self, opened: socket.socket) -> None:
        """Starts reading a bound, non-blocking socket, and closes it at the end."""
        self._socket = opened
        self._loop = asyncio.get_running_loop()
        self._gate = ReadGate(opened, self._came)
        self._connected = ConnectedSockets(opened, self._read_connected)

    def follow(self, close: Set[tuple[str, int]]) -> None:
        """Datagrams from these addresses are read at once from now on. Call it several times a second."""
        if self._connected is not None:
            self._pacer.urgent = not self._connected.follow(close)

    def _came(self) -> None:
        now = time.monotonic()
        rest_s = self._pacer.arrived(now)
        if rest_s is None:
            self._read(now, 1)
            self._watch()  # if another datagram is pending, it is called again at once
        else:
            self._resting = self._loop.call_later(rest_s, self._rested)

    def _rested(self) -> None:
        now = time.monotonic()
        count = self._read(now, MAX_CONCURRENT)
        rest_s = 0.0 if count == MAX_CONCURRENT else self._pacer.read_after_rest(count)
        if rest_s is None:
            self._resting = None
            self._watch()
        else:
            self._resting = self._loop.call_later(rest_s, self._rested)

    def _watch(self) -> None:
        if self._gate is not None:
            self._gate.watch()

    def _read_connected(self, connected: socket.socket) -> None:
        self._read(time.monotonic(), MAX_CONCURRENT, connected)

    def _read(self, now: float, most: int, readable: socket.socket | None = None) -> int:
        """Reads one round, from the shared socket by default. Returns the number of datagrams."""
        readable = readable or self._socket
        assert readable is not None
        receive, received = readable.recvfrom, self.datagram_received
        self.write_round.begin()
        try:
            taken = 0
            for count in range(most * JUNK_BESIDE):
                try:
                    datagram, address = receive(_ROOM_BYTES)
                except OSError:  # nothing left; or an ICMP error for a datagram of ours, which the keep-alive detects
                    return min(count, most)
                taken += received(datagram, address, now)
                if taken == most or (count % CHECK_EVERY == CHECK_EVERY - 1 and time.monotonic() - now > SLICE_S):
                    break
        finally:
            self.write_round.end()
        return most

    def datagram_received(self, datagram: bytes, address: tuple[str, int], now: float) -> bool:
        """Handles one datagram from any sender. `address` may have more than host and port. False: it was not
        examined."""
        # The link id is only trusted once the datagram is decrypted, and is then checked again.
        link_id = LinkId(int.from_bytes(datagram[2:6], "little"))
        anonymous = self._anonymous
        if anonymous is not None and link_id not in self._hub.state.links and not anonymous.junk.take(1.0, now):
            self._hub.state.drops[DropReason.UNKNOWN_LINK] += 1
            anonymous.refused[Over.DATAGRAMS] += 1
            return False
        try:
            self._hub.datagram(datagram, link_id, address[:2], now)
        except Dropped as dropped:
            self._hub.state.drops[dropped.reason] += 1
        except Exception as error:  # it costs this datagram, and not the socket of all drones
            link = self._hub.state.links.get(link_id)
            self._hub.state.on_fault("datagrams", None if link is None else link.drone_id, error)
        return True

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        """Sends at once; what the kernel cannot take is lost, as on any network."""
        if self._socket is not None and self.may_act():
            with contextlib.suppress(OSError):
                self._socket.sendto(datagram, address)
            traffic = self._hub.state.traffic
            traffic.datagrams_to_agents += 1
            traffic.bytes_to_agents += len(datagram)

    @property
    def port(self) -> int:
        """The port that the kernel assigned."""
        assert self._socket is not None
        return cast("int", self._socket.getsockname()[1])

    def close(self) -> None:
        """Closes the socket."""
        if self._resting is not None:
            self._resting.cancel()
        if self._connected is not None:
            self._connected.close()
            self._connected = None
        if self._gate is not None:
            self._gate.close()
            self._gate = None
        if self._socket is not None:
            self._socket.close()
            self._socket = None


async def open_data_endpoint(hub: Hub, host: str, port: int, anonymous: AnonymousBudget | None = None) -> DataEndpoint:
    """Binds the data channel's socket (port 0: the kernel picks one). Raises OSError if the port is in use."""
    found = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    family, kind, protocol, _, address = found[0]
    opened = socket.socket(family, kind, protocol)
    try:
        opened.setblocking(False)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        opened.bind(address)
    except OSError:
        opened.close()
        raise
    endpoint = DataEndpoint(hub, anonymous)
    endpoint.listen_on(opened)
    _log.info("data_channel_open", host=host, port=endpoint.port)
    return endpoint
