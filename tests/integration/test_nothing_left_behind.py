"""Closed connections, however they end, leave nothing for the garbage collector: it runs rarely, and stops the tower
when it does (server/runtime/garbage.py)."""

import asyncio
import contextlib
import gc
import logging
import time
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from tower_world import TowerWorld, start_tower
from uvicorn.protocols.http.httptools_impl import RequestResponseCycle
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidStatus
from websockets.server import ServerProtocol
from websockets.typing import Subprotocol

from bench.key_sign_in import say_hello
from server.app.serving import MAX_MESSAGE_BYTES
from server.kernel.people import Role
from server.link.api.agent_channel import AgentChannel
from server.link.api.live_channel import LiveChannel
from server.link.api.live_writer import LiveWriter
from server.link.api.websocket.direct_websocket import DirectWebSocket
from server.link.api.websocket.upgrading_http import UpgradingHttp
from server.link.core.agent_link import AgentLink
from server.live.browser import Browser
from wire.control_messages import KEY_SUBPROTOCOL
from wire.drone_key import DroneKey

WATCHED = (
    *(UpgradingHttp, RequestResponseCycle, DirectWebSocket, ServerProtocol),
    *(AgentChannel, AgentLink, LiveChannel, LiveWriter, Browser),
)
EACH = 10
DEADLINE_S = 30.0
REFUSED = 200


async def _refused(opened: Callable[..., Awaitable[ClientConnection]]) -> None:
    with pytest.raises(InvalidStatus):
        await opened(credential="twd_1_" + "a" * 43)


async def _bytes_first(opened: Callable[..., Awaitable[ClientConnection]]) -> None:
    connection = await opened()
    await connection.send(b"x")
    await connection.wait_closed()


async def _gone_first(opened: Callable[..., Awaitable[ClientConnection]]) -> None:
    connection = await opened()
    connection.transport.abort()
    await connection.wait_closed()


async def _key_refused(opened: Callable[..., Awaitable[ClientConnection]], key: DroneKey) -> None:
    connection = await opened()
    await say_hello(connection, DroneKey(key.drone_id, b"x" * 32))
    await connection.wait_closed()


async def _signed_in(
    opened: Callable[..., Awaitable[ClientConnection]], key: DroneKey, then: bytes | None = None
) -> None:
    connection = await opened()
    await say_hello(connection, key)
    await connection.recv()
    if then is not None:
        await connection.send(then, text=True)
        await connection.wait_closed()
    await connection.close()


ENDS: dict[str, Callable[[Callable[..., Awaitable[ClientConnection]], DroneKey], Awaitable[None]]] = {
    "its first message is none": lambda opened, key: _bytes_first(opened),
    "it goes before it has said anything": lambda opened, key: _gone_first(opened),
    "its key is not known": _key_refused,
    "it says good-bye": _signed_in,
    "its message is no text": lambda opened, key: _signed_in(opened, key, b"\xff\xfe"),
    "its message is too large": lambda opened, key: _signed_in(opened, key, b"x" * (MAX_MESSAGE_BYTES + 1)),
}


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path, user_sockets=10 * EACH) as running:
        yield running


def alive() -> Counter[str]:
    return Counter(type(one).__name__ for one in gc.get_objects() if type(one) in WATCHED)


async def nothing_left(before: Counter[str], what: str) -> None:
    """Closing a connection takes some turns of the loop."""
    deadline = time.monotonic() + DEADLINE_S
    while left := alive() - before:
        if time.monotonic() > deadline:
            pytest.fail(f"{what}: {dict(left)}")
        await asyncio.sleep(0.02)


async def test_agents_leave_nothing_behind(world: TowerWorld, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL, "uvicorn.error")  # pytest would keep the tracebacks from there
    drone = await world.add_drone("hawk")

    async def opened(credential: str = "") -> ClientConnection:
        return await connect(
            world.agent_url,
            subprotocols=[Subprotocol(KEY_SUBPROTOCOL)],
            additional_headers={"Authorization": f"Bearer {credential}"} if credential else None,
            compression=None,
            proxy=None,
            ping_interval=None,
        )

    gc.collect()
    gc.disable()
    try:
        before = alive()
        for _ in range(REFUSED):
            await _refused(opened)
        await nothing_left(before, "refused")
        for what, end in ENDS.items():
            for _ in range(EACH):
                await end(opened, drone.key)
            await nothing_left(before, what)
    finally:
        gc.enable()


async def test_browsers_leave_nothing_behind(world: TowerWorld) -> None:
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    headers = {**world.cookie_header(root), "Origin": world.base_url}

    async def opened() -> ClientConnection:
        connection = await connect(
            world.live_url,
            subprotocols=[Subprotocol("tower.v1")],
            additional_headers=headers,
            compression=None,
            proxy=None,
            ping_interval=None,
        )
        await connection.recv()
        return connection

    gc.collect()
    gc.disable()
    try:
        before = alive()
        for end in ("good-bye", "too large", "gone"):
            for _ in range(EACH):
                connection = await opened()
                if end == "gone":
                    connection.transport.abort()
                elif end == "too large":
                    await connection.send("x" * (MAX_MESSAGE_BYTES + 1))
                    await connection.wait_closed()
                await connection.close()
            await nothing_left(before, end)
    finally:
        gc.enable()


def _posted(body: bytes) -> bytes:
    head = (
        b"POST /api/v1/session HTTP/1.1\r\nHost: tower\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n"
    )
    return head % len(body) + body


GOT = b"GET /api/v1/%s HTTP/1.1\r\nHost: tower\r\n\r\n"
SENT: dict[str, bytes] = {
    "more requests than may wait": GOT % b"me" * 100,
    "fewer, and it goes": GOT % b"me" * 3,
    "a body that is no JSON": _posted(b"{a:"),
    "a body that lacks everything": _posted(b"{}"),
    "no such page": GOT % b"nothing",
    "a wrong password": _posted(b'{"name": "nobody", "password": "wrong"}'),
    "half a head": b"GET / HTTP/1.1\r\n",
    "no HTTP": b"\0" * 100,
}


async def test_requests_leave_nothing_behind(world: TowerWorld) -> None:
    await world.add_drone("hawk")
    place = urlsplit(world.base_url)
    gc.collect()
    gc.disable()
    try:
        before = alive()
        for what, sent in SENT.items():
            for number in range(EACH):
                reader, writer = await asyncio.open_connection(place.hostname, place.port)
                writer.write(sent)
                if number % 2:
                    with contextlib.suppress(TimeoutError):
                        await asyncio.wait_for(reader.read(), 0.03)
                writer.transport.abort()
            await nothing_left(before, what)
    finally:
        gc.enable()
