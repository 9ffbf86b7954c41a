"""An emulated network between two programs on loopback: a proxy at either end carries UDP and TCP across.

Each proxy has one side on loopback and one on a host of the emulated network, so real packets of a real kernel cross.
TCP ends at the proxies; between them the network's losses and delays apply.
"""

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator

from udp_proxy import Address, UdpProxy, running_proxy, udp_socket

from bench.namespaces import Network


@contextlib.asynccontextmanager
async def udp_through(net: Network, tower: Address) -> AsyncIterator[UdpProxy]:
    """Carries UDP from the drone's host to the tower's and on to `tower`. Yields the proxy at the drone."""
    with net.inside("tower"):
        front = udp_socket()
        front.bind((net.address("tower"), 0))
    between = front.getsockname()
    async with running_proxy(tower, front), running_proxy(between) as at_drone:

        def at_the_drone() -> socket.socket:
            with net.inside("drone"):
                return udp_socket()

        at_drone.make_back = at_the_drone
        yield at_drone


@contextlib.asynccontextmanager
async def tcp_through(net: Network, tower: Address) -> AsyncIterator[int]:
    """Carries TCP the same way. Yields the loopback port at which the drone's side listens."""
    with net.inside("tower"):
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listener.bind((net.address("tower"), 0))
    between = listener.getsockname()
    carrying: set[asyncio.Task[None]] = set()

    def carry(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, host: str | None, address: Address) -> None:
        task = asyncio.create_task(_carry(net, reader, writer, host, address))
        carrying.add(task)
        task.add_done_callback(carrying.discard)

    at_tower = await asyncio.start_server(lambda r, w: carry(r, w, None, tower), sock=listener)
    at_drone = await asyncio.start_server(lambda r, w: carry(r, w, "drone", between), "127.0.0.1", 0)
    try:
        yield at_drone.sockets[0].getsockname()[1]
    finally:
        for task in carrying:
            task.cancel()
        await asyncio.gather(*carrying, return_exceptions=True)
        at_drone.close()
        at_tower.close()


async def _carry(
    net: Network, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, host: str | None, address: Address
) -> None:
    """Carries one connection on to `address`, from a host of the network or from loopback."""
    with contextlib.ExitStack() as stack:
        if host is not None:
            stack.enter_context(net.inside(host))
        onward = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    onward.setblocking(False)
    try:
        await asyncio.get_running_loop().sock_connect(onward, address)
        on_reader, on_writer = await asyncio.open_connection(sock=onward)
    except OSError:
        onward.close()
        writer.close()
        return
    try:
        await asyncio.wait(
            [asyncio.create_task(_pump(reader, on_writer)), asyncio.create_task(_pump(on_reader, writer))],
            return_when=asyncio.FIRST_COMPLETED,
        )
    finally:
        for one in (writer, on_writer):
            one.transport.abort()


async def _pump(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while data := await reader.read(16 * 1024):
            writer.write(data)
            await writer.drain()
