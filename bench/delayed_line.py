"""A line between agent and tower that can be slowed during use, on a separate loopback address.

It listens at 127.0.0.2 with the tower's own port numbers, TCP and UDP, so an agent needs only that address. Data in
transit when the delay changes keeps its order.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Callable
from typing import Final

HOST: Final = "127.0.0.2"
MAX_DATAGRAM_BYTES: Final = 65_536

Address = tuple[str, int]


class DelayedLine:
    """`delay_s` applies to each direction; it may be changed at any time."""

    def __init__(self, tcp_port: int, udp_port: int) -> None:
        self.delay_s = 0.0
        self._tcp_port, self._udp_port = tcp_port, udp_port
        self._loop = asyncio.get_running_loop()
        self._server: asyncio.Server | None = None
        self._front: socket.socket | None = None
        self._backs: dict[Address, socket.socket] = {}
        """The socket towards the tower for each agent."""
        self._tasks: set[asyncio.Task[None]] = set()
        self._last_due: dict[int, float] = {}

    async def open(self) -> None:
        self._server = await asyncio.start_server(self._accept, HOST, self._tcp_port)
        self._front = _udp_socket()
        self._front.bind((HOST, self._udp_port))
        self._loop.add_reader(self._front, self._from_agents)

    async def close(self) -> None:
        for sock in (self._front, *self._backs.values()):
            if sock is not None:
                self._loop.remove_reader(sock)
                sock.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._server is not None:
            self._server.close()

    def _later(self, way: int, work: Callable[[], object]) -> None:
        """Not before earlier data in the same direction."""
        due = max(self._loop.time() + self.delay_s, self._last_due.get(way, 0.0))
        self._last_due[way] = due
        self._loop.call_at(due, work)

    def _from_agents(self) -> None:
        assert self._front is not None
        while True:
            try:
                data, agent = self._front.recvfrom(MAX_DATAGRAM_BYTES)
            except (BlockingIOError, ConnectionError):
                return
            back = self._backs.get(agent) or self._new_back(agent)
            self._later(back.fileno(), lambda back=back, data=data: _send(back, data, None))  # type: ignore[misc]

    def _new_back(self, agent: Address) -> socket.socket:
        back = _udp_socket()
        back.connect(("127.0.0.1", self._udp_port))
        self._backs[agent] = back
        self._loop.add_reader(back, self._from_tower, back, agent)
        return back

    def _from_tower(self, back: socket.socket, agent: Address) -> None:
        front = self._front
        assert front is not None
        while True:
            try:
                data = back.recv(MAX_DATAGRAM_BYTES)
            except (BlockingIOError, ConnectionError):
                return
            self._later(-back.fileno(), lambda data=data: _send(front, data, agent))  # type: ignore[misc]

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there_reader, there_writer = await asyncio.open_connection("127.0.0.1", self._tcp_port)
        for one, other in ((reader, there_writer), (there_reader, writer)):
            task = asyncio.create_task(self._carry(one, other))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        way = id(writer)
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(MAX_DATAGRAM_BYTES):
                self._later(way, lambda data=data: None if writer.is_closing() else writer.write(data))  # type: ignore[misc]
        self._later(way, writer.close)


def _udp_socket() -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setblocking(False)
    return sock


def _send(sock: socket.socket, data: bytes, to: Address | None) -> None:
    with contextlib.suppress(OSError):  # closed, or no listener: lost, as datagrams are
        if to is None:
            sock.send(data)
        else:
            sock.sendto(data, to)


@contextlib.asynccontextmanager
async def delayed_line(tcp_port: int, udp_port: int) -> AsyncIterator[DelayedLine]:
    """Connects agents with the tower that listens at these ports of 127.0.0.1."""
    line = DelayedLine(tcp_port, udp_port)
    await line.open()
    try:
        yield line
    finally:
        await line.close()
