"""A UDP proxy between agents and the tower that a test can make misbehave: block, change its ports, lose, repeat.

Each source address gets its own port towards the tower, as behind a NAT.
"""

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Callable
from typing import Any

Address = tuple[str, int]


class UdpProxy(asyncio.DatagramProtocol):
    """`tower`: where the tower listens. `port`: where agents send."""

    def __init__(self, tower: Address) -> None:
        self.tower = tower
        self.port = 0
        self.blocked: set[str] = set()
        """Agent addresses whose datagrams are dropped, both ways; "" blocks all."""
        self.blocked_up = False
        """Drops only datagrams to the tower."""
        self.largest_bytes = 65535
        """Larger datagrams are lost, as on a path with a small MTU."""
        self.up: list[tuple[Address, bytes]] = []
        """Every datagram received for the tower."""
        self.hear_down: Callable[[bytes], None] = lambda _: None
        """Called with every datagram to an agent."""
        self.make_back = udp_socket
        """Makes the socket of one agent's port towards the tower."""
        self._front: asyncio.DatagramTransport | None = None
        self._backs: dict[Address, socket.socket] = {}

    def connection_made(self, transport: Any) -> None:
        self._front = transport
        self.port = transport.get_extra_info("sockname")[1]

    def datagram_received(self, data: bytes, addr: Address) -> None:
        self.up.append((addr, data))
        if not self._passes(addr, data) or self.blocked_up:
            return
        self._back_of(addr).send(data)

    def _back_of(self, agent: Address) -> socket.socket:
        back = self._backs.get(agent)
        if back is None:
            back = self._backs[agent] = self.make_back()
            back.setblocking(False)
            back.connect(self.tower)
            asyncio.get_running_loop().add_reader(back, self._from_tower, agent, back)
        return back

    def _from_tower(self, agent: Address, back: socket.socket) -> None:
        with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
            while True:
                data = back.recv(65535)
                self.hear_down(data)
                if self._front is not None and self._passes(agent, data):
                    self._front.sendto(data, agent)

    def _passes(self, agent: Address, data: bytes) -> bool:
        return not self.blocked & {"", agent[0]} and len(data) <= self.largest_bytes

    @property
    def ports(self) -> set[int]:
        """The ports at which the tower currently sees agents."""
        return {back.getsockname()[1] for back in self._backs.values()}

    def forget(self) -> None:
        """Acts as a restarted NAT: every agent gets another port from now on."""
        for back in self._backs.values():
            asyncio.get_running_loop().remove_reader(back)
            back.close()
        self._backs.clear()

    def replay(self, number: int) -> None:
        """Sends a received datagram once more, from another port."""
        agent, data = self.up[number]
        self._back_of(("replayed", agent[1])).send(data)

    def close(self) -> None:
        self.forget()
        if self._front is not None:
            self._front.close()


def udp_socket() -> socket.socket:
    return socket.socket(socket.AF_INET, socket.SOCK_DGRAM)


@contextlib.asynccontextmanager
async def running_proxy(tower: Address, front: socket.socket | None = None) -> AsyncIterator[UdpProxy]:
    """`front`: the bound socket where agents send; None: a port on loopback."""
    if front is None:
        front = udp_socket()
        front.bind(("127.0.0.1", 0))
    front.setblocking(False)
    _, proxy = await asyncio.get_running_loop().create_datagram_endpoint(lambda: UdpProxy(tower), sock=front)
    try:
        yield proxy
    finally:
        proxy.close()
