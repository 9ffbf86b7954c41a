"""Browsers that never read, or send without end: they lose their connection, and nobody else loses a frame."""

import asyncio
import gc
import os
import socket
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import httpx
import pytest
from control_world import ObedientAgent, live, until
from tower_world import Person, TowerWorld, start_tower
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame

from server.kernel.people import Role
from server.link.api.websocket import direct_websocket
from server.link.api.websocket.direct_websocket import (
    HIGH_WATER_BYTES,
    MAX_PIECES,
    SLICE_BYTES,
    DirectWebSocket,
)
from server.link.core.outbox import MAX_TRANSACTIONAL
from wire.dialect import build, mavlink
from wire.drops import DropReason
from wire.frames import payload
from wire.ids import Epoch
from wire.sealing import read_link_id
from wire.tagged import split_tagged

ACKS = 8_000
PACE = 50
"""Maximum acknowledgements between two turns of the loop; the good browser reads meanwhile."""

PING, BINARY, PIECE = 0x89, 0x82, 0x00


def ack(number: int) -> bytes:
    message = mavlink.MAVLink_command_ack_message(number, 1)
    return build(message, system_id=1, component_id=1, sequence=number & 0xFF)


class Agent(ObedientAgent):
    def say(self, *frames: bytes) -> None:
        now = time.monotonic()
        for datagram in self._sealed.seal_frames(Epoch(0), frames, now):
            self._hub.datagram(datagram, read_link_id(datagram), ("203.0.113.1", 5), now)


@pytest.fixture(autouse=True)
def busy_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Extends the limits, so that a stalled browser stays connected until the test has made its checks."""
    monkeypatch.setattr(direct_websocket, "STALLED_AFTER_S", 600.0)


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path, user_sockets=5, agent_frames_per_s=1_000_000) as world:
        yield world


@pytest.fixture
async def root(world: TowerWorld) -> Person:
    return await world.add_user("root", Role.ADMIN)


@pytest.fixture
async def agent(world: TowerWorld) -> Agent:
    drone = await world.add_drone("Kestrel")
    made = Agent(world.tower.hub, drone.id)
    made.state()
    return made


def masked(first: int, payload: bytes = b"") -> bytes:
    """Returns a client's WebSocket frame, masked with zeros."""
    assert len(payload) < 126
    return bytes((first, 0x80 | len(payload))) + bytes(4) + payload


@asynccontextmanager
async def raw_browser(world: TowerWorld, client: httpx.AsyncClient) -> AsyncIterator[tuple[socket.socket, bytes]]:
    """Opens a live connection as a bare socket that reads nothing after the response to its upgrade."""
    url = httpx.URL(world.base_url)
    loop = asyncio.get_running_loop()
    with socket.socket() as plain:
        plain.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        plain.setblocking(False)
        await loop.sock_connect(plain, (url.host, url.port))
        request = (
            f"GET /api/v1/live HTTP/1.1\r\nHost: {url.host}:{url.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
            f"Cookie: {world.cookie_header(client)['Cookie']}\r\n\r\n"
        )
        await loop.sock_sendall(plain, request.encode())
        answer = b""
        while b"\r\n\r\n" not in answer:
            answer += await loop.sock_recv(plain, 1)
        assert b" 101 " in answer
        yield plain, answer


def connections() -> list[DirectWebSocket]:
    found = [one for one in gc.get_objects() if issubclass(type(one), DirectWebSocket)]
    return [one for one in found if not one.disconnected]


async def everything_reaches(
    world: TowerWorld,
    client: httpx.AsyncClient,
    agent: Agent,
    *,
    beside: int,
    begin: Callable[[], object] = lambda: None,
) -> None:
    """Sends many acknowledgements while `beside` others misbehave; a browser that reads gets each of them, in order.

    Calls `begin` once all are attached, because a misbehaving one would be closed before.
    """
    async with live(world, client) as good:
        await until("all are attached", lambda: len(world.tower.hub.state.browsers) == beside + 1)
        begin()
        numbers: list[int] = []
        sent = 0
        async with asyncio.timeout(60):
            while len(numbers) < ACKS:
                if sent < ACKS and sent - len(numbers) < 1_000:
                    agent.say(*(ack(number) for number in range(sent, sent + PACE)))
                    sent += PACE
                message = await good.socket.recv()
                if isinstance(message, bytes):
                    frames = [frame for _, frame in split_tagged(message) if frame[7] == 77]
                    numbers += [int.from_bytes(payload(frame)[:2], "little") for frame in frames]
    assert numbers == list(range(ACKS))


@pytest.mark.parametrize("bytes_a_tick", [0, 1])
async def test_one_that_hardly_reads_is_cut_and_costs_the_others_nothing(
    world: TowerWorld, root: Person, agent: Agent, bytes_a_tick: int
) -> None:
    hub, client = world.tower.hub, await world.signed_in(root)
    loop = asyncio.get_running_loop()
    async with raw_browser(world, client) as (plain, _):

        async def sip() -> None:
            while bytes_a_tick:
                await loop.sock_recv(plain, bytes_a_tick)
                await asyncio.sleep(0.05)

        sipping = asyncio.create_task(sip())
        try:
            await everything_reaches(world, client, agent, beside=1)
            await until("the other is gone", lambda: len(hub.state.browsers) == len(connections()) == 1)
            (stalled,) = hub.state.browsers.values()
            events, transactional, _ = stalled.waiting()
            assert 0 < transactional <= MAX_TRANSACTIONAL
            assert events < 2_000
            (connection,) = connections()
            assert connection.transport.get_write_buffer_size() < 3 * HIGH_WATER_BYTES
            # Its deadline is set.
            assert connection._stalled is not None
            assert connection._stalled.when() - loop.time() <= direct_websocket.STALLED_AFTER_S
            connection.transport.abort()
            await until("it is cut", lambda: not hub.state.browsers and not connections())
        finally:
            sipping.cancel()
            await asyncio.gather(sipping, return_exceptions=True)


async def test_the_time_of_one_that_does_not_read_runs_out(
    world: TowerWorld, root: Person, agent: Agent, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(direct_websocket, "STALLED_AFTER_S", 0.2)
    client = await world.signed_in(root)
    async with raw_browser(world, client):
        await until("it is attached", lambda: world.tower.hub.state.browsers)
        for start in range(0, 6_000, PACE):
            agent.say(*(ack(number) for number in range(start, start + PACE)))
            await asyncio.sleep(0)
        await until("it is cut", lambda: not world.tower.hub.state.browsers and not connections())


async def test_closing_one_that_does_not_read_does_not_leave_its_socket_behind(
    world: TowerWorld, root: Person, agent: Agent, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(direct_websocket, "LINGER_S", 0.2)
    client = await world.signed_in(root)
    async with raw_browser(world, client):
        await until("it is attached", lambda: world.tower.hub.state.browsers)
        for start in range(0, 6_000, PACE):
            agent.say(*(ack(number) for number in range(start, start + PACE)))
            await asyncio.sleep(0)
        (browser,) = world.tower.hub.state.browsers.values()
        browser.end(4429, "enough")
        await until("nothing is left of it", lambda: not world.tower.hub.state.browsers and not connections())


async def test_pings_without_end_whose_answers_nobody_reads_pile_nothing_up(
    world: TowerWorld, root: Person, agent: Agent
) -> None:
    client = await world.signed_in(root)
    loop = asyncio.get_running_loop()
    async with raw_browser(world, client) as (plain, _):
        await until("it is attached", lambda: world.tower.hub.state.browsers)
        pings = masked(PING, bytes(125)) * 500
        for _ in range(100):  # 6.5 MB
            await loop.sock_sendall(plain, pings)
        (connection,) = connections()
        assert connection.transport.get_write_buffer_size() < 2 * HIGH_WATER_BYTES
        await everything_reaches(world, client, agent, beside=1)


async def test_tiny_messages_without_end_are_closed_with_a_code_and_the_other_browser_gets_everything(
    world: TowerWorld, root: Person, agent: Agent, monkeypatch: pytest.MonkeyPatch
) -> None:
    hub = world.tower.hub
    parsed_at_once = [0]
    handled, parse = DirectWebSocket.handle_bytes, WebSocketsSansIOProtocol.data_received

    def counted(connection: DirectWebSocket, event: Frame) -> None:
        parsed_at_once[-1] += 1
        handled(connection, event)

    def begun(connection: DirectWebSocket, data: bytes) -> None:
        parsed_at_once.append(0)
        parse(connection, data)

    monkeypatch.setattr(DirectWebSocket, "handle_bytes", counted)
    monkeypatch.setattr(WebSocketsSansIOProtocol, "data_received", begun)
    mallory = await world.add_user("mallory")
    flooding, client = await world.signed_in(mallory), await world.signed_in(root)
    loop = asyncio.get_running_loop()
    async with raw_browser(world, flooding) as (plain, _):
        await until("it is attached", lambda: hub.state.browsers)

        async def flood() -> None:
            try:
                while True:
                    await loop.sock_sendall(plain, masked(BINARY, b"\xff") * 20_000)
            except ConnectionError:
                return

        flooders: list[asyncio.Task[None]] = []
        await everything_reaches(
            world, client, agent, beside=1, begin=lambda: flooders.append(asyncio.create_task(flood()))
        )
        await asyncio.wait_for(flooders[0], 60)
    assert hub.state.drops[DropReason.FLOOD] >= 5_000
    assert 100 < max(parsed_at_once) <= SLICE_BYTES // len(masked(BINARY, b"\xff")) + 1, "and not a whole read of them"
    assert not hub.state.browsers


async def test_one_who_goes_on_after_being_told_reads_why_it_is_closed(world: TowerWorld, root: Person) -> None:
    client = await world.signed_in(root)
    headers = {**world.cookie_header(client), "Origin": world.base_url}
    async with connect(world.live_url, additional_headers=headers, compression=None, proxy=None) as flooding:

        async def flood() -> None:
            with pytest.raises(ConnectionClosed):
                while True:
                    await flooding.send('{"type":"focus","drone_id":null}')

        flooder = asyncio.create_task(flood())
        with pytest.raises(ConnectionClosed):
            async with asyncio.timeout(30):
                while True:
                    await flooding.recv()
        await flooder
        assert flooding.close_code == 4429


async def test_connections_beyond_the_bound_are_closed_with_a_code(world: TowerWorld, root: Person) -> None:
    other = await world.add_user("other")
    client, others = await world.signed_in(root), await world.signed_in(other)
    headers = {**world.cookie_header(client), "Origin": world.base_url}
    opened = [await connect(world.live_url, additional_headers=headers, compression=None, proxy=None) for _ in range(5)]
    await until("all are attached", lambda: len(world.tower.hub.state.browsers) == 5)
    async with connect(world.live_url, additional_headers=headers, compression=None, proxy=None) as one_more:
        with pytest.raises(ConnectionClosed):
            await one_more.recv()
        assert one_more.close_code == 4430
        assert "5 connections" in str(one_more.close_reason)
    async with live(world, others):
        await until("somebody else is let in", lambda: len(world.tower.hub.state.browsers) == 6)
    await opened[0].close()
    await until("there is room", lambda: len(world.tower.hub.state.browsers) == 4)
    async with live(world, client):
        await until("there is room again", lambda: len(world.tower.hub.state.browsers) == 5)
    for connection in opened[1:]:
        await connection.close()


async def test_a_message_in_endless_pieces_is_ended(world: TowerWorld, root: Person) -> None:
    client = await world.signed_in(root)
    loop = asyncio.get_running_loop()
    async with raw_browser(world, client) as (plain, _):
        await until("it is attached", lambda: world.tower.hub.state.browsers)
        await loop.sock_sendall(plain, masked(0x02) + masked(PIECE) * (2 * MAX_PIECES))
        await until("it is gone", lambda: not world.tower.hub.state.browsers)
        received = b""
        while part := await asyncio.wait_for(loop.sock_recv(plain, 65536), 30):
            received += part
    assert (1009).to_bytes(2, "big") in received


async def test_the_memory_of_the_tower_stays_where_it_was(world: TowerWorld, root: Person, agent: Agent) -> None:
    client = await world.signed_in(root)
    async with raw_browser(world, client), raw_browser(world, client):
        await everything_reaches(world, client, agent, beside=2)
        gc.collect()
        before_kib = resident_kib()
        for _ in range(3):
            await everything_reaches(world, client, agent, beside=2)
        gc.collect()
        assert resident_kib() - before_kib < 8 * 1024, "24,000 frames for each of two that do not read"


def resident_kib() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024
