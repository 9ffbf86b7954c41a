"""The tower ends connections that never send a request, and endless headers, but keeps those that have sent a
request."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest
from control_world import live
from tower_world import TowerWorld, start_tower

from server.anonymous.core.budget import Over
from server.kernel.people import Role
from server.link.api.websocket import upgrading_http

HEAD_WITHIN_S = 0.3
DRIP_S = 0.05
AT_MOST_S = 10.0


@pytest.fixture
async def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[TowerWorld]:
    monkeypatch.setattr(upgrading_http, "HEAD_WITHIN_S", HEAD_WITHIN_S)
    async with start_tower(tmp_path) as running:
        yield running


@asynccontextmanager
async def connection(world: TowerWorld) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    port = int(world.base_url.rsplit(":", 1)[1])
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        yield reader, writer
    finally:
        writer.close()


async def ended(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, drip: bytes) -> bool:
    """Whether the tower closes it while bytes arrive one after the other."""
    try:
        async with asyncio.timeout(AT_MOST_S):
            for byte in drip * 1000:
                writer.write(bytes((byte,)))
                await writer.drain()
                await asyncio.sleep(DRIP_S)
                if reader.at_eof():
                    return True
            return await reader.read() == b""
    except ConnectionError:
        return True
    except TimeoutError:
        return False


async def test_who_says_nothing_or_a_byte_now_and_then_is_ended(world: TowerWorld) -> None:
    async with connection(world) as (reader, writer):
        assert await ended(reader, writer, b"")
    async with connection(world) as (reader, writer):
        writer.write(b"GET /api/v1/health HTTP/1.1\r\n")
        assert await ended(reader, writer, b"x")


async def test_who_sends_many_requests_before_the_first_answer_is_ended(world: TowerWorld) -> None:
    request = b"GET /api/v1/me HTTP/1.1\r\nhost: x\r\n\r\n"
    async with connection(world) as (reader, writer):
        writer.write(request * 3)
        for _ in range(3):
            head = await reader.readuntil(b"\r\n\r\n")
            assert head.startswith(b"HTTP/1.1 401")
            await reader.readexactly(int(head.lower().partition(b"content-length:")[2].split(b"\r\n")[0]))
        writer.write(request * 1_000)
        answered = b""
        async with asyncio.timeout(AT_MOST_S):
            with suppress(ConnectionError):
                answered = await reader.read()
    assert answered.count(b"HTTP/1.1 401") <= 1 + upgrading_http.MAX_PIPELINED
    assert world.tower.anonymous.refused[Over.PIPELINE] == 1


async def test_who_does_not_read_the_answer_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(upgrading_http, "STALLED_AFTER_S", HEAD_WITHIN_S)
    (tmp_path / "dist").mkdir()
    (tmp_path / "dist" / "index.html").write_text("x" * 20_000_000)
    async with start_tower(tmp_path, web=tmp_path / "dist", trusted_proxies="192.0.2.1") as world:
        port = int(world.base_url.rsplit(":", 1)[1])
        reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=1024)
        writer.write(b"GET / HTTP/1.1\r\nhost: x\r\n\r\n")
        await reader.readuntil(b"\r\n\r\n")
        async with asyncio.timeout(AT_MOST_S):
            while len(world.tower.anonymous.connections):  # noqa: ASYNC110
                await asyncio.sleep(DRIP_S)
        writer.close()


async def test_who_has_asked_once_is_no_exception(world: TowerWorld) -> None:
    async with connection(world) as (reader, writer):
        writer.write(b"GET /api/v1/me HTTP/1.1\r\nhost: x\r\n\r\n")
        assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 401")
        reading = asyncio.create_task(reader.read())
        assert await ended(reader, writer, b"\r\n")
        await asyncio.gather(reading, return_exceptions=True)


async def test_who_has_come_to_a_request_has_time(world: TowerWorld) -> None:
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    async with live(world, root) as screen, connection(world) as (reader, writer):
        body = b'{"name": "Root", "password": "x"}'
        head = (
            f"POST /api/v1/session HTTP/1.1\r\nhost: x\r\ncontent-type: application/json\r\ncontent-length: {len(body)}"
        )
        writer.write(head.encode() + b"\r\n\r\n" + body[:5])
        await asyncio.sleep(3 * HEAD_WITHIN_S)
        await world.add_drone("hawk")
        assert (await screen.event("drone"))["drone"]["name"] == "hawk"
        writer.write(body[5:])
        assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 401")


HEAD = b"GET /api/v1/health HTTP/1.1\r\nhost: x\r\n"
JSON_HEAD = b"POST /api/v1/session HTTP/1.1\r\nhost: x\r\ncontent-type: application/json\r\n"


@pytest.mark.parametrize(
    "endless",
    [
        pytest.param(HEAD + b"a:b\r\n" * 50_000, id="headers"),
        pytest.param(HEAD + b"a: " + b"b" * 300_000, id="one header"),
        pytest.param(b"GET /" + b"a" * 300_000, id="address"),
        pytest.param(
            JSON_HEAD + b"transfer-encoding: chunked\r\n\r\n1\r\n{\r\n0\r\na: " + b"b" * 300_000,
            id="trailer",
        ),
    ],
)
async def test_a_head_without_end_is_refused(world: TowerWorld, endless: bytes) -> None:
    async with connection(world) as (reader, writer), asyncio.timeout(AT_MOST_S):
        writer.write(endless)
        assert (await reader.readline()).startswith(b"HTTP/1.1 431")


async def test_heads_and_bodies_of_common_size_are_read(world: TowerWorld) -> None:
    async with connection(world) as (reader, writer), asyncio.timeout(AT_MOST_S):
        usual = b"".join(b"x-%d: %s\r\n" % (number, b"v" * 100) for number in range(90))
        for _ in range(3):
            writer.write(HEAD + usual + b"\r\n")
            assert (await reader.readline()).startswith(b"HTTP/1.1 200")
            length = 0
            while (line := await reader.readline()) != b"\r\n":
                if line.lower().startswith(b"content-length:"):
                    length = int(line.split(b":")[1])
            await reader.readexactly(length)
        body = b'{"name": "Root", "password": "wrong"}'
        writer.write(JSON_HEAD + b"transfer-encoding: chunked\r\n\r\n")
        writer.write(b"".join(b"1\r\n%c\r\n" % byte for byte in body) + b"0\r\n\r\n")
        assert (await reader.readline()).startswith(b"HTTP/1.1 401")
