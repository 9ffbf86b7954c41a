"""Each way to reach an autopilot, on real sockets and a real pseudo-terminal."""

import asyncio
import contextlib
import os
import pty
import tty
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from agent_fakes import until

from onboard_agent.autopilot_port.port import MAX_BACKLOG_BYTES, AutopilotPort
from onboard_agent.autopilot_port.serial_line import SerialLine
from onboard_agent.autopilot_port.tcp import TcpIn, TcpOut
from onboard_agent.autopilot_port.udp import RECEIVE_BUFFER_BYTES, UdpIn, UdpOut
from onboard_agent.unusable import Unusable
from wire.dialect import build, mavlink

FRAME = build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), system_id=1, component_id=1, sequence=7)
HOST = "127.0.0.1"
LIMIT = Path("/proc/sys/net/core/rmem_max")
MAX_BUFFER_BYTES = int(LIMIT.read_text()) if LIMIT.exists() else 0


@contextlib.asynccontextmanager
async def running(port: AutopilotPort) -> AsyncIterator[bytearray]:
    came = bytearray()
    task = asyncio.create_task(port.run(came.extend))
    try:
        yield came
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


async def closed(writer: asyncio.StreamWriter) -> None:
    writer.close()
    with contextlib.suppress(ConnectionError):
        await writer.wait_closed()


class Socket(asyncio.DatagramProtocol):
    """A UDP socket of the test, with what it received."""

    def __init__(self) -> None:
        self.came: list[bytes] = []
        self.senders: list[tuple[str, int]] = []

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        self.came.append(data)
        self.senders.append(addr)


@contextlib.asynccontextmanager
async def udp_socket() -> AsyncIterator[tuple[asyncio.DatagramTransport, Socket, int]]:
    loop = asyncio.get_running_loop()
    transport, socket = await loop.create_datagram_endpoint(Socket, local_addr=(HOST, 0))
    try:
        yield transport, socket, transport.get_extra_info("sockname")[1]
    finally:
        transport.close()


async def test_udpin_answers_the_one_who_sent_a_valid_frame() -> None:
    port = UdpIn("udpin", HOST, 0)
    async with running(port) as came, udp_socket() as (one, at_one, _), udp_socket() as (two, at_two, _):
        await until(lambda: port.bound_port)
        one.sendto(b"noise", (HOST, port.bound_port))
        two.sendto(FRAME, (HOST, port.bound_port))
        await until(lambda: bytes(came) == FRAME)
        one.sendto(FRAME, (HOST, port.bound_port))
        await until(lambda: port.counts["from another peer"] == 2)
        port.send(b"answer")
        await until(lambda: at_two.came == [b"answer"])
        assert at_one.came == []
        assert bytes(came) == FRAME


@pytest.mark.parametrize("way", ["udpin", "udpout"])
async def test_a_list_of_parameters_waits_in_the_socket_while_the_agent_is_not_run(way: str) -> None:
    if MAX_BUFFER_BYTES < RECEIVE_BUFFER_BYTES:
        pytest.skip("the kernel allows no such buffer here")
    async with udp_socket() as (transport, at_us, number):
        port = UdpIn(way, HOST, 0) if way == "udpin" else UdpOut(way, HOST, number)
        async with running(port) as came:
            if isinstance(port, UdpIn):
                to: tuple[str, int] = (HOST, await until(lambda: port.bound_port))
            else:
                await until(lambda: port.send(FRAME) or at_us.senders)
                to = at_us.senders[0]
            for _ in range(1000):  # without yielding to the loop
                transport.sendto(FRAME, to)
            await until(lambda: len(came) == 1000 * len(FRAME))


async def test_udpin_on_a_port_in_use_is_said_in_one_line() -> None:
    async with udp_socket() as (_, _, taken):
        with pytest.raises(Unusable, match="used by another program"):
            await UdpIn(f"udpin:{HOST}:{taken}", HOST, taken).run(lambda data: None)


async def test_udpout_speaks_first_and_hears_the_answer() -> None:
    async with udp_socket() as (transport, socket, number):
        port = UdpOut("udpout", HOST, number)
        async with running(port) as came:
            await until(lambda: port.send(FRAME) or socket.came)
            transport.sendto(FRAME, socket.senders[0])
            await until(lambda: bytes(came) == FRAME)


async def test_tcp_connects_when_the_autopilot_comes_and_again_when_it_has_gone() -> None:
    writers: list[asyncio.StreamWriter] = []

    async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writers.append(writer)

    server = await asyncio.start_server(accept, HOST, 0)
    number = server.sockets[0].getsockname()[1]
    port = TcpOut("tcp", HOST, number)
    async with running(port) as came:
        await until(lambda: len(writers) == 1)
        writers[0].write(FRAME)
        await until(lambda: bytes(came) == FRAME)
        writers[0].close()
        await until(lambda: len(writers) == 2)
        writers[1].write(FRAME)
        await until(lambda: bytes(came) == FRAME * 2)
    for writer in writers:
        await closed(writer)
    server.close()
    await server.wait_closed()


async def test_tcp_to_a_port_that_closes_at_once_is_tried_ever_less_often() -> None:
    """A simulator that already has a connection does this."""
    came: list[float] = []
    loop = asyncio.get_running_loop()

    async def refuse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        came.append(loop.time())
        await closed(writer)

    server = await asyncio.start_server(refuse, HOST, 0)
    async with server, running(TcpOut("tcp", HOST, server.sockets[0].getsockname()[1])):
        await until(lambda: len(came) >= 4)
    assert came[3] - came[1] >= 0.3  # 0.25 s and 0.5 s, each shortened by up to a half


async def test_tcp_waits_for_an_autopilot_that_is_not_there_yet() -> None:
    async with udp_socket() as (_, _, number):  # a port without a TCP listener
        port = TcpOut("tcp", HOST, number)
        async with running(port):
            port.send(FRAME)
            assert port.counts["autopilot not there"] == 1
            connected = asyncio.Event()

            async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                connected.set()
                await closed(writer)

            async with await asyncio.start_server(accept, HOST, number):
                await asyncio.wait_for(connected.wait(), 30.0)


async def test_tcpin_keeps_the_first_connection_while_it_lives() -> None:
    port = TcpIn("tcpin", HOST, 0)
    async with running(port) as came:
        await until(lambda: port.bound_port)
        reader, writer = await asyncio.open_connection(HOST, port.bound_port)
        writer.write(FRAME)
        await until(lambda: bytes(came) == FRAME)
        second, second_writer = await asyncio.open_connection(HOST, port.bound_port)
        with contextlib.suppress(ConnectionError):
            assert await second.read() == b""
        port.send(b"answer")
        assert await reader.readexactly(6) == b"answer"
        await closed(writer)
        await closed(second_writer)


async def test_tcp_drops_rather_than_waits_when_the_autopilot_does_not_read() -> None:
    port = TcpIn("tcpin", HOST, 0)
    async with running(port):
        await until(lambda: port.bound_port)
        _, writer = await asyncio.open_connection(HOST, port.bound_port)

        def flooded() -> bool:
            for _ in range(200):
                port.send(bytes(4096))
            return port.counts["autopilot too slow"] > 0

        try:
            await until(flooded)
            assert port.backlog_bytes <= MAX_BACKLOG_BYTES
        finally:
            writer.transport.abort()
            await closed(writer)


@contextlib.contextmanager
def terminal(link: Path) -> Iterator[int]:
    """A pseudo-terminal whose far end appears as a serial device under `link`."""
    master, device = pty.openpty()
    tty.setraw(master)
    tty.setraw(device)
    link.unlink(missing_ok=True)
    link.symlink_to(os.ttyname(device))
    os.close(device)
    try:
        yield master
    finally:
        os.close(master)


async def test_a_serial_line_comes_goes_and_comes_back(tmp_path: Path) -> None:
    link = tmp_path / "ttyAMA0"
    port = SerialLine("serial", str(link), 57_600)
    async with running(port) as came:
        port.send(FRAME)
        assert port.counts["autopilot not there"] == 1
        for turn in (1, 2):
            with terminal(link) as master:
                await until(lambda: port.is_open, what=f"opened, turn {turn}")
                os.write(master, FRAME)
                await until(lambda turn=turn: bytes(came) == FRAME * turn)
                port.send(b"answer")
                os.set_blocking(master, False)
                answer = await until(lambda master=master: _read(master))
                assert answer == b"answer"
            await until(lambda: not port.is_open)


async def test_a_serial_line_that_does_not_drain_drops_and_then_goes_on(tmp_path: Path) -> None:
    link = tmp_path / "ttyAMA0"
    port = SerialLine("serial", str(link), 57_600)
    with terminal(link) as master:
        async with running(port):
            await until(lambda: port.is_open)
            await until(lambda: port.send(bytes(280)) or port.counts["autopilot too slow"])
            os.set_blocking(master, False)
            await until(lambda: not _read(master) and not port.backlog_bytes)
            port.send(b"after")
            assert await until(lambda: _read(master)) == b"after"


def _read(fd: int) -> bytes:
    try:
        return os.read(fd, 65536)
    except BlockingIOError:
        return b""
