"""The shells of `tower connect` alone: access from a web page, proxies, a tower that closes at once."""

import asyncio
import contextlib
import json
from collections.abc import Hashable
from pathlib import Path

import pytest
from agent_fakes import until
from websockets.asyncio.server import ServerConnection, serve

from connect.endpoints import TcpOn
from connect.live import Live
from connect.rest import Rest
from connect.tower_url import parse_tower_url
from connect.unusable import TowerAway
from onboard_agent.link.enrolment import enrol
from onboard_agent.link.tower_url import parse_tower_url as parse_for_agent
from onboard_agent.unusable import Unusable
from wire.dialect import build, mavlink

HOST = "127.0.0.1"
FRAME = build(mavlink.MAVLink_manual_control_message(1, 900, 0, 500, 0, 0), system_id=255, component_id=190, sequence=0)


async def test_a_web_page_cannot_fly_through_the_tcp_port() -> None:
    """Any web page in a browser on this machine may send a request to the port, with whole frames in it."""
    came: list[bytes] = []
    gone: list[Hashable] = []
    endpoint = TcpOn(HOST, 0)
    await endpoint.open(lambda _, data: came.append(data), gone.append)
    number = int(endpoint.name.rpartition(":")[2])
    try:
        reader, writer = await asyncio.open_connection(HOST, number)
        writer.write(b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n" % len(FRAME) + FRAME)
        assert await asyncio.wait_for(reader.read(), 30.0) == b""
        assert came == []
        writer.close()
        _, program = await asyncio.open_connection(HOST, number)
        program.write(FRAME)
        await until(lambda: came == [FRAME])
        program.close()
        await until(lambda: len(gone) == 2)
    finally:
        endpoint.close()


async def test_a_tower_that_lets_in_and_closes_at_once_is_asked_ever_less_often() -> None:
    came: list[float] = []
    loop = asyncio.get_running_loop()

    async def close_at_once(connection: ServerConnection) -> None:
        came.append(loop.time())
        await connection.close(4429, "enough")

    async def shut(_: str) -> None:
        raise AssertionError

    async with serve(close_at_once, HOST, 0) as server:
        tower = parse_tower_url(f"http://{HOST}:{server.sockets[0].getsockname()[1]}")
        live = Live(tower, "twt_x", hello=[], received=lambda _: None, say=lambda _: None, shut=shut)
        running = asyncio.create_task(live.run(watch_only=lambda: True))
        await until(lambda: len(came) >= 4)
        running.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await running
    assert came[3] - came[1] >= 0.3  # 0.25 s and 0.5 s, each shortened by up to a half


async def test_secrets_in_the_clear_do_not_go_to_a_proxy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[bytes] = []

    async def proxy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        asked.append(await reader.read(64))
        writer.close()

    async def nobody(_: ServerConnection) -> None:
        return

    async with await asyncio.start_server(proxy, HOST, 0) as listening, serve(nobody, HOST, 0) as tower_server:
        address = f"http://{HOST}:{listening.sockets[0].getsockname()[1]}"
        for name in ("http_proxy", "HTTP_PROXY", "all_proxy", "ALL_PROXY"):
            monkeypatch.setenv(name, address)
        for name in ("no_proxy", "NO_PROXY"):
            monkeypatch.delenv(name, raising=False)
        origin = f"http://{HOST}:{tower_server.sockets[0].getsockname()[1]}"
        with contextlib.suppress(TowerAway, json.JSONDecodeError):
            await Rest(parse_tower_url(origin), "twt_x").ask("GET", "/drones")
        with pytest.raises(Unusable):
            await asyncio.to_thread(enrol, parse_for_agent(origin), "twe_x", tmp_path / "token")
        connected: list[str] = []

        async def shut(_: str) -> None:
            raise AssertionError

        live = Live(
            parse_tower_url(origin), "twt_x", hello=[], received=lambda _: None, say=connected.append, shut=shut
        )
        running = asyncio.create_task(live.run(watch_only=lambda: True))
        await until(lambda: bool(connected))
        running.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await running
    assert asked == []
