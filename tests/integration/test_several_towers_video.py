"""Video with two towers: the camera's agent is at one of them, the viewers are at the other."""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from statistics import median
from typing import Any

import httpx
import pytest
import shared_bus_world
from agent_fakes import until
from control_world import ask
from shared_bus_world import Two
from tower_world import TowerWorld
from video_world import CameraAgent, Watcher, camera_agent, filming, watching_video
from worlds.nats import TemporaryNats

from server.kernel.people import Role
from server.towers.core.place import Place
from wire.ids import DroneId
from wire.video import CameraState, Codec, Quality

cluster, nats = shared_bus_world.cluster, shared_bus_world.nats
postgres, two = shared_bus_world.postgres, shared_bus_world.two

MEDIUM = (Quality.MEDIUM, Codec.MPEG1)
HIGH = (Quality.HIGH, Codec.MPEG1)
ENDS_WITHIN_S = 60.0


@contextlib.asynccontextmanager
async def watching(
    world: TowerWorld, client: httpx.AsyncClient, drone_id: int, **options: Any
) -> AsyncIterator[Watcher]:
    headers = {**world.cookie_header(client), "Origin": world.base_url}
    async with watching_video(world, drone_id, headers, **options) as watcher:
        yield watcher


async def wanted(agent: CameraAgent, *streams: tuple[Quality, Codec]) -> None:
    def asked() -> bool:
        reported = agent.wanted
        return reported is not None and tuple((one.quality, one.codec) for one in reported.streams) == streams

    await until(asked, what=f"the agent to be asked for {streams}")


@pytest.fixture
async def camera(two: Two) -> AsyncIterator[CameraAgent]:
    """At tower a."""
    async with camera_agent(two.a, two.drone) as agent:
        await agent.announce(CameraState.LIVE, codecs=(Codec.MPEG1, Codec.H264))
        await until(lambda: two.at(two.b).place is Place.ELSEWHERE, what="b to know its home")
        yield agent


async def test_a_viewer_at_another_tower_sees_it_while_they_watch(two: Two, camera: CameraAgent) -> None:
    drone_id = two.drone.id
    assert camera.wanted is not None and not camera.wanted.streams, "nobody watches"
    async with watching(two.b, two.alice, drone_id) as watcher:
        await wanted(camera, MEDIUM)
        await camera.open_video()
        async with filming(camera):
            await watcher.until(lambda: len(watcher.delays_s()) >= 60)
            assert watcher.units[0].key
            sequences = [unit.sequence for unit in watcher.units]
            assert sequences == sorted(set(sequences)), "each comes once"
            assert watcher.states()[-1] == "live"
            assert watcher.reported[-1]["codecs"] == ["mpeg1", "h264"]
            delay_s = median(watcher.delays_s()[20:])
            print(f"from the capture to a viewer at another tower: {1000 * delay_s:.1f} ms")
            assert 0.0 < delay_s < 10.0, "the time of capture is by the clock of the viewer's tower"

            async with (
                watching(two.b, two.alice, drone_id) as second,
                watching(two.a, await two.a.signed_in(two.owner), drone_id),
            ):
                await second.until(lambda: len(second.units) >= 5)
                seen = (await two.alice.get(f"/api/v1/drones/{drone_id}/video")).json()
                await until(lambda: two.a.tower.hub.video.count() == (1, 1), what="one viewer at a")
                async with asyncio.timeout(20):
                    while [one["viewers"] for one in seen["streams"]] != [3]:
                        await asyncio.sleep(0.05)
                        seen = (await two.alice.get(f"/api/v1/drones/{drone_id}/video")).json()
                assert seen["state"] == "live"
            await watcher.ask(type="want", quality="high", codec="mpeg1")
            await wanted(camera, MEDIUM, HIGH)
            await wanted(camera, HIGH)
            shown = (await two.root.get("/metrics")).text
            assert 'tower_bus_video_streams{direction="in"} 1.0' in shown
            assert "tower_bus_video_connected 1.0" in shown
    left_at = time.monotonic()
    await wanted(camera)
    print(f"the camera stopped {time.monotonic() - left_at:.1f} s after the last viewer had left")
    assert time.monotonic() - left_at < ENDS_WITHIN_S


async def test_who_may_not_see_the_drone_sees_no_video_of_another_tower(two: Two, camera: CameraAgent) -> None:
    mallory = await two.b.signed_in(await two.b.add_user("Mallory", Role.OPERATOR))
    async with watching(two.b, mallory, two.drone.id) as stranger:
        assert await stranger.until_closed() == 4404
    async with watching(two.b, two.alice, two.drone.id) as watcher, watching(two.b, two.root, two.drone.id) as admin:
        await camera.open_video()
        async with filming(camera):
            await watcher.until(lambda: len(watcher.units) >= 5)
            assert (await ask(two.alice, two.drone.id, "acquire")).status_code == 200
            took = await ask(two.root, two.drone.id, "take", video="move")
            assert took.status_code == 200, took.text
            taken_at, had = time.monotonic(), len(admin.units)
            assert await watcher.until_closed() == 4403
            print(f"the viewer was shut out {1000 * (time.monotonic() - taken_at):.0f} ms after the answer to the TAKE")
            await admin.until(lambda: len(admin.units) >= had + 10)


async def test_without_the_bus_the_viewer_is_told_and_it_comes_back(
    two: Two, camera: CameraAgent, nats: TemporaryNats
) -> None:
    async with watching(two.b, two.alice, two.drone.id) as watcher:
        await camera.open_video()
        async with filming(camera):
            await watcher.until(lambda: len(watcher.units) >= 10)
            nats.kill()
            killed_at = time.monotonic()
            try:
                await watcher.until(lambda: watcher.states()[-1] == "offline")
                assert "not within reach" in watcher.reported[-1]["words"]
                print(f"told {time.monotonic() - killed_at:.1f} s after the bus was lost")
                await wanted(camera)
            finally:
                nats.start()
            started_at = time.monotonic()
            await watcher.until(lambda: watcher.states()[-1] == "live")
            await watcher.until(lambda: len(watcher.delays_s(started_at)) >= 10)
            back = [unit for unit, at in zip(watcher.units, watcher.came_at, strict=True) if at > started_at]
            print(f"back {watcher.came_at[-len(back)] - started_at:.1f} s after it")
            assert back[0].key


async def test_who_reads_slowly_at_another_tower_delays_nobody(two: Two, camera: CameraAgent) -> None:
    key_size, size = 40_000, 9_000
    async with (
        watching(two.b, two.alice, two.drone.id) as fast,
        watching(two.b, two.alice, two.drone.id, receive_buffer=4096) as slow,
    ):
        await camera.open_video()
        slow.bytes_per_s = 40_000
        async with filming(camera, key_size=key_size, size=size):
            await fast.until(lambda: len(fast.units) >= 20)
            since = time.monotonic()
            await fast.until(lambda: len(fast.delays_s(since)) >= 72)
            await slow.until(lambda: slow.skipped() > 0)
            delays = sorted(fast.delays_s(since))
            print(
                f"beside a slow viewer: median {1000 * median(delays):.1f} ms, worst {1000 * delays[-1]:.0f} ms; "
                f"the slow one got {len(slow.units)} and skipped {slow.skipped()}"
            )
            assert median(delays) < 0.2
            assert fast.skipped() < slow.skipped()
            assert len(slow.units) < len(fast.units) / 2


async def test_the_picture_follows_a_drone_that_moves_to_another_tower_and_back(two: Two, camera: CameraAgent) -> None:
    at_a = await two.a.signed_in(two.owner)
    async with watching(two.b, two.alice, two.drone.id) as watcher, watching(two.a, at_a, two.drone.id) as other:
        await camera.open_video()
        async with filming(camera):
            await watcher.until(lambda: len(watcher.units) >= 10)
            await other.until(lambda: len(other.units) >= 10)
        await camera.go()
        async with camera_agent(two.b, two.drone) as moved:
            await until(lambda: two.at(two.b).place is Place.HERE, what="the drone to be at home at b")
            await moved.announce(CameraState.LIVE)
            await moved.open_video()
            moved_at = time.monotonic()
            async with filming(moved):
                await watcher.until(lambda: len(watcher.delays_s(moved_at)) >= 10)
                await other.until(lambda: len(other.delays_s(moved_at)) >= 10)
                assert two.at(two.a).place is Place.ELSEWHERE
                assert (watcher.states()[-1], other.states()[-1]) == ("live", "live")
        async with camera_agent(two.a, two.drone) as back:
            await until(lambda: two.at(two.a).place is Place.HERE, what="the drone to be at home at a")
            await back.open_video()
            back_at = time.monotonic()
            async with filming(back):
                await watcher.until(lambda: len(watcher.delays_s(back_at)) >= 10)
                await other.until(lambda: len(other.delays_s(back_at)) >= 10)
    assert DroneId(two.drone.id) in two.b.tower.hub.state.drones
