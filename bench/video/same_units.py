"""Feeds both relays with the same units at the same times, so that only the relays are compared.

The units are recorded from the real agent first. Then the tower gets them from an agent of the benchmark, linked and
kept alive, which flies nothing; the Node relay gets the MPEG-TS in each of them as one piece of a POST.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Final

from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

from bench.lean_browser import LeanBrowser, connect_browser
from bench.load_agents import LoadAgent, kept_alive, sign_in_all
from bench.load_tower import LoadTower, load_tower
from bench.peers.jsmpeg import SECRET, Relay
from bench.rig import wait_for
from wire.video import AGENT_VIDEO_SUBPROTOCOL, VIDEO, VIEWER_VIDEO_SUBPROTOCOL, Unit, decode_unit, encode_unit

RECORD_S: Final = 8.0

Recorded = list[tuple[float, Unit]]
"""Seconds from the first, which is a key picture, to each. Another key followed the last, so the recording can
repeat."""
Send = Callable[[Unit], Awaitable[None]]


async def recorded(url: str, path: str, cookie: str) -> Recorded:
    """Records what a viewer of the tower gets, with times, from the second key picture on: earlier units are
    backlog."""
    came: Recorded = []
    keys: list[int] = []

    browsers: list[LeanBrowser] = []

    def take(message: bytes) -> None:
        unit = decode_unit(message)
        browsers[0].send_text(f'{{"type":"got","sequence":{unit.sequence}}}')
        if unit.key:
            keys.append(len(came))
        came.append((time.monotonic(), unit))

    def begin(browser: LeanBrowser) -> None:
        browser.on_binary = take
        browsers.append(browser)

    browser = await connect_browser(url, path=path, cookie=cookie, subprotocol=VIEWER_VIDEO_SUBPROTOCOL, before=begin)
    try:
        await wait_for("pictures to record", lambda: len(keys) > 2)
        await asyncio.sleep(RECORD_S)
    finally:
        browser.close()
    units = came[keys[1] : keys[-1]]
    return [(at - units[0][0], unit) for at, unit in units]


@contextlib.asynccontextmanager
async def _played(units: Recorded, send: Send) -> AsyncIterator[None]:
    """Repeats until the block ends, numbered as one stream."""
    period_s = units[-1][0] + units[-1][0] / (len(units) - 1)

    async def play() -> None:
        begun = time.monotonic()
        numbers = itertools.count()
        for turn in itertools.count():
            for after_s, unit in units:
                await asyncio.sleep(begun + turn * period_s + after_s - time.monotonic())
                now_us = time.monotonic_ns() // 1000
                await send(unit._replace(sequence=next(numbers), is_break=False, capture_us=now_us))

    playing = asyncio.create_task(play())
    try:
        yield
    finally:
        playing.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await playing


@contextlib.asynccontextmanager
async def quiet_tower(folder: Path) -> AsyncIterator[tuple[LoadTower, LoadAgent]]:
    """A tower with one drone, whose agent has a camera and flies nothing."""
    async with load_tower(folder, drones=1) as tower:
        agents = await sign_in_all(tower.url, tower.keys, takes=(VIDEO,))
        async with kept_alive(agents):
            yield tower, agents[0]


@contextlib.asynccontextmanager
async def tower_fed(tower: LoadTower, agent: LoadAgent, units: Recorded) -> AsyncIterator[None]:
    """The tower accepts only units that it has requested, so a viewer must be watching."""
    await wait_for("the ticket of the video channel", lambda: agent.video_wanted)
    assert agent.video_wanted is not None
    async with connect(
        tower.url.replace("http", "ws", 1) + "/api/v1/agent/video",
        subprotocols=[Subprotocol(AGENT_VIDEO_SUBPROTOCOL)],
        additional_headers={"Authorization": f"Bearer {agent.video_wanted.ticket}"},
        compression=None,
        proxy=None,
    ) as channel:

        async def hear() -> None:
            async for _ in channel:
                pass

        async def send(unit: Unit) -> None:
            await channel.send(encode_unit(unit))

        hearing = asyncio.create_task(hear())
        try:
            async with _played(units, send):
                yield
        finally:
            hearing.cancel()
            await asyncio.gather(hearing, return_exceptions=True)


@contextlib.asynccontextmanager
async def relay_fed(relay: Relay, units: Recorded) -> AsyncIterator[None]:
    """A chunk for each picture, as ffmpeg does."""
    _, writer = await asyncio.open_connection(relay.address, relay.stream_port)
    head = f"POST /{SECRET} HTTP/1.1\r\nHost: {relay.address}\r\nTransfer-Encoding: chunked\r\n\r\n"
    writer.write(head.encode())

    async def send(unit: Unit) -> None:
        writer.write(f"{len(unit.payload):x}\r\n".encode() + unit.payload + b"\r\n")
        await writer.drain()

    try:
        async with _played(units, send):
            yield
    finally:
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
