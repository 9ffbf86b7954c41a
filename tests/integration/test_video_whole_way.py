"""Video from a camera to a viewer: a real agent with its video process, a real tower, a real WebSocket."""

import asyncio
import contextlib
import io
import os
import signal
import time
from collections.abc import AsyncIterator
from pathlib import Path
from statistics import median
from typing import Any

import av
import pytest
from agent_fakes import until
from tower_world import NewDrone, TowerWorld, start_tower
from video_tower import MjpegCamera
from video_world import Watcher, watching_video

from onboard_agent.agent import Agent, AgentSettings
from onboard_agent.autopilot_port.udp import UdpIn
from onboard_agent.link.tower_url import parse_tower_url
from wire.video import Unit


class Scene:
    """Alice's drone, its agent, and a camera that can be unplugged."""

    def __init__(self, world: TowerWorld) -> None:
        self.world = world
        self.camera = MjpegCamera()

    async def set_up(self, stack: contextlib.AsyncExitStack) -> None:
        self.alice = await self.world.add_user("alice")
        self.drone: NewDrone = await self.world.add_drone("Kestrel", self.alice)
        await self.camera.plug_in()
        stack.push_async_callback(self.camera.unplug)
        settings = AgentSettings(
            tower=parse_tower_url(self.world.base_url),
            identity=self.drone.identity,
            port=UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0),
            camera=f"http://127.0.0.1:{self.camera.port}/camera",
        )
        self.agent = Agent(settings)
        running = asyncio.create_task(self.agent.run())
        stack.push_async_callback(_end, running)
        self.client = await self.world.signed_in(self.alice)
        async with asyncio.timeout(20):
            while not (await self.client.get(f"/api/v1/drones/{self.drone.id}")).json()["online"]:  # noqa: ASYNC110
                await asyncio.sleep(0.05)

    @contextlib.asynccontextmanager
    async def watching(self, query: str = "?quality=medium&codec=mpeg1") -> AsyncIterator[Watcher]:
        headers = {**self.world.cookie_header(self.client), "Origin": self.world.base_url}
        async with watching_video(self.world, self.drone.id, headers, query=query) as watcher:
            yield watcher

    @property
    def pid(self) -> int | None:
        return self.agent._video_child.pid


async def _end(task: "asyncio.Task[None]") -> None:
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with contextlib.AsyncExitStack() as stack:
        scene = Scene(await stack.enter_async_context(start_tower(tmp_path)))
        await scene.set_up(stack)
        yield scene


def pictures(units: list[Unit]) -> list[Any]:
    """Returns what a decoder makes of them."""
    with av.open(io.BytesIO(b"".join(unit.payload for unit in units)), format="mpegts") as container:
        return list(container.decode(video=0))


async def test_a_viewer_sees_what_the_camera_gives_at_once_and_only_while_they_watch(scene: Scene) -> None:
    assert scene.pid is None, "nobody watches"
    async with scene.watching() as watcher:
        await watcher.until(lambda: len(watcher.units) >= 40)
        settled_at = time.monotonic()
        await watcher.until(lambda: len(watcher.delays_s(settled_at)) >= 60)
        assert watcher.units[0].key
        assert watcher.states()[-1] == "live"
        shown = pictures(watcher.units)
        assert len(shown) >= len(watcher.units) - 2
        assert {(picture.width, picture.height) for picture in shown} == {(320, 240)}
        assert median(watcher.delays_s(settled_at)) < 0.1
        assert scene.pid is not None
    await until(lambda: not scene.agent._video.watched.streams, what="nobody watches any more")


async def test_the_camera_is_unplugged_and_the_viewer_is_told(scene: Scene) -> None:
    async with scene.watching() as watcher:
        await watcher.until(lambda: len(watcher.units) >= 10)
        await scene.camera.unplug()
        await watcher.until(lambda: watcher.states()[-1] == "camera-lost")
        before = len(watcher.units)
        await scene.camera.plug_in()
        plugged_at = time.monotonic()
        await watcher.until(lambda: watcher.states()[-1] == "live")
        await watcher.until(lambda: len(watcher.delays_s(plugged_at)) >= 5)
        back = next(unit for unit in watcher.units[before:] if unit.is_break)
        assert back.key


async def test_a_video_process_that_dies_is_replaced_and_the_viewer_stays(scene: Scene) -> None:
    async with scene.watching() as watcher:
        await watcher.until(lambda: len(watcher.units) >= 10)
        gone = scene.pid
        assert gone is not None
        os.kill(gone, signal.SIGKILL)
        await until(lambda: scene.pid not in (None, gone), what="another process")
        since = time.monotonic()
        await watcher.until(lambda: len(watcher.delays_s(since)) >= 10)
        back = [unit for unit, at in zip(watcher.units, watcher.came_at, strict=True) if at > since]
        assert back[0].key
        assert watcher.states()[-1] == "live"
    assert scene.agent._link.up
