"""A stranger learns nothing about a drone's video, neither from the content of a response nor from its time."""

import asyncio
import contextlib
import re
import time
from collections.abc import AsyncIterator
from pathlib import Path
from statistics import median

import pytest
from agent_fakes import until
from tower_world import TowerWorld, start_tower
from video_world import camera_agent

from wire.video import VIEWER_VIDEO_SUBPROTOCOL, CameraState, Codec

NOT_THERE = 9
"""Has as many digits as the id of the existing drone."""
PAIRS = 40
APART_S = 0.005
"""The medians of two identical cases are much closer, on any machine."""

UPGRADE = (
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    f"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: {VIEWER_VIDEO_SUBPROTOCOL}\r\n"
)
ASKED = {
    "the channel": ("GET", "/video", UPGRADE),
    "the channel, any quality": ("GET", "/video?quality=best&codec=none", UPGRADE),
    "its state": ("GET", "/video", ""),
    "recordings": ("GET", "/recordings", ""),
    "a recording": ("GET", "/recordings/1", ""),
    "a file": ("GET", "/recordings/1/file", ""),
    "part of a file": ("GET", "/recordings/1/file", "Range: bytes=0-99\r\n"),
    "to begin one": ("POST", "/recordings", "Content-Length: 0\r\n"),
    "to end one": ("POST", "/recordings/1/stop", "Content-Length: 0\r\n"),
    "to delete one": ("DELETE", "/recordings/1", ""),
}


class Stranger:
    """A signed-in user without rights to the drone. Sends raw bytes."""

    def __init__(self, world: TowerWorld, cookie: str) -> None:
        self._world = world
        self._cookie = cookie

    async def ask(self, drone_id: int, method: str, path: str, more: str) -> tuple[bytes, float]:
        """Returns everything received until the tower closes, and the seconds until the first byte."""
        base = self._world.base_url
        host, _, port = base.removeprefix("http://").partition(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        head = f"{method} /api/v1/drones/{drone_id}{path} HTTP/1.1\r\nHost: {host}:{port}\r\nOrigin: {base}\r\n"
        end = "" if more == UPGRADE else "Connection: close\r\n"
        writer.write(f"{head}Cookie: {self._cookie}\r\n{end}{more}\r\n".encode())
        begun = time.perf_counter()
        came = await reader.read(1)
        took_s = time.perf_counter() - begun
        if more == UPGRADE:
            # The tower's close frame; it waits for ours.
            while b"\x88" not in came.partition(b"\r\n\r\n")[2]:
                came += await reader.read(4096)
            writer.write(b"\x88\x80\0\0\0\0")
        with contextlib.suppress(ConnectionError):
            came += await reader.read()
        writer.close()
        return came, took_s


def without_when_and_where(answer: bytes, drone_id: int) -> bytes:
    """Removes the time of day, the random id of the request, and the requested address, which the response repeats."""
    answer = re.sub(rb"\r\n(date|x-request-id): [^\r]*", b"", answer, flags=re.IGNORECASE)
    return answer.replace(f"/drones/{drone_id}/".encode(), b"/drones/N/")


@pytest.fixture
async def stranger(tmp_path: Path) -> AsyncIterator[Stranger]:
    """A stranger beside a drone with a camera, which another user holds and records."""
    async with start_tower(tmp_path) as world:
        alice, mallory = await world.add_user("alice"), await world.add_user("mallory")
        drone = await world.add_drone("Kestrel", alice)
        assert drone.id == 1
        holder = await world.signed_in(alice)
        async with camera_agent(world, drone) as agent:
            await agent.announce(CameraState.LIVE, codecs=(Codec.MPEG1,))
            assert (await holder.post("/api/v1/drones/1/control/acquire")).status_code == 200
            path = "/api/v1/drones/1/recordings"
            begun = [await holder.post(path)]
            while begun[-1].status_code == 409:
                await asyncio.sleep(0.02)
                begun.append(await holder.post(path))
            assert begun[-1].json()["id"] == 1
            await until(lambda: agent.wanted is not None and agent.wanted.streams, what="the drone to be asked")
            client = await world.signed_in(mallory)
            yield Stranger(world, world.cookie_header(client)["Cookie"])


@pytest.mark.parametrize("what", ASKED)
async def test_the_answer_is_that_of_a_drone_that_is_not_there(stranger: Stranger, what: str) -> None:
    times: dict[int, list[float]] = {1: [], NOT_THERE: []}
    answers: set[bytes] = set()
    for _ in range(PAIRS):
        for drone_id, took in times.items():
            answer, took_s = await stranger.ask(drone_id, *ASKED[what])
            took.append(took_s)
            answers.add(without_when_and_where(answer, drone_id))
    assert len(answers) == 1, answers
    [answer] = answers
    assert (b"there is no such drone" if "channel" in what else b"unknown-drone") in answer, answer
    theirs_s, nowhere_s = (median(took) for took in times.values())
    print(f"{what}: {theirs_s * 1e3:.2f} and {nowhere_s * 1e3:.2f} ms")
    assert abs(theirs_s - nowhere_s) < APART_S + 0.3 * nowhere_s
