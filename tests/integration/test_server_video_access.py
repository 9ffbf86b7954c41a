"""Video ends with the session, the account or the lease; floods and slow viewers are contained."""

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from agent_fakes import until
from tower_world import assert_problem, start_tower
from video_scene import MEDIUM, Scene, wanted
from video_world import Watcher, filming
from websockets.exceptions import ConnectionClosed

from server.link.core.flood_gate import FLOODING
from server.video.core import drone_video
from server.video.core.drone_video import UNITS_BURST


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        async with scene.stack:
            await scene.set_up()
            yield scene


async def test_the_end_of_a_session_ends_its_video(scene: Scene) -> None:
    watcher = await scene.watch()
    await watcher.until(lambda: watcher.states())
    assert (await scene.client.delete("/api/v1/session")).status_code == 204
    assert await watcher.until_closed() == 4401


async def test_a_disabled_account_and_a_lost_drone_end_video_at_once(scene: Scene) -> None:
    watcher = await scene.watch()
    root = await scene.world.signed_in(scene.admin)
    of_admin = await scene.watch(root)
    await of_admin.until(lambda: of_admin.states())
    answer = await root.patch(f"/api/v1/users/{scene.alice.id}", json={"disabled": True})
    assert answer.status_code == 200, answer.text
    assert await watcher.until_closed() == 4401
    assert (await root.delete(f"/api/v1/drones/{scene.drone.id}")).status_code in (200, 204)
    assert await of_admin.until_closed() == 4404


@pytest.mark.parametrize("how", ["view", "video"])
async def test_take_moves_the_video_if_the_admin_says_so(scene: Scene, how: str) -> None:
    base = f"/api/v1/drones/{scene.drone.id}/control"
    root = await scene.world.signed_in(scene.admin)
    assert (await scene.client.post(f"{base}/acquire")).status_code == 200
    watcher = await scene.watch()
    await scene.agent.open_video()
    await wanted(scene, MEDIUM)
    await scene.agent.send(key=True)
    await watcher.until(lambda: watcher.units)
    body = {"watch": False} if how == "view" else {"video": "move"}
    assert (await root.post(f"{base}/take", json=body)).status_code == 200
    await scene.agent.send()
    assert await watcher.until_closed() == 4403
    assert len(watcher.units) == 1
    assert "Kestrel" in (watcher.connection.close_reason or "")
    again = await scene.watch()
    assert await again.until_closed() == 4403
    assert_problem(await scene.client.get(f"/api/v1/drones/{scene.drone.id}/video"), 403, "view-taken")
    seen = (await scene.client.get(f"/api/v1/drones/{scene.drone.id}")).json()
    assert (seen["may_watch"], seen["may_watch_video"]) == (how == "video", False)
    assert (await root.post(f"{base}/give")).status_code == 200
    offered = await scene.watch()
    await offered.until(offered.states)
    await scene.agent.send(key=True)
    await offered.until(lambda: offered.units)
    trail = (await root.get("/api/v1/audit", params={"action": "control.take"})).json()
    detail = trail["records"][0]["detail"] if "records" in trail else trail[0]["detail"]
    assert detail["video_taken"] is True
    assert detail["view_taken"] is (how == "view")


async def test_take_keeps_the_video_unless_it_is_said(scene: Scene) -> None:
    base = f"/api/v1/drones/{scene.drone.id}/control"
    root = await scene.world.signed_in(scene.admin)
    assert (await scene.client.post(f"{base}/acquire")).status_code == 200
    watcher = await scene.watch()
    await scene.agent.open_video()
    await wanted(scene, MEDIUM)
    assert (await root.post(f"{base}/take", json={})).status_code == 200
    await scene.agent.send(key=True)
    await watcher.until(lambda: watcher.units)


async def test_what_is_no_unit_ends_the_agents_channel_and_nonsense_a_viewers(scene: Scene) -> None:
    watcher = await scene.watch()
    channel = await scene.agent.open_video()
    await channel.send(b"\x07" * 100)
    await until(lambda: channel.close_code == 4400, what="the end of the channel")
    await watcher.ask(type="fly")
    assert await watcher.until_closed() == 4400
    for large in (b"{" * 2_000, b"\x00" * 10):
        one = await scene.watch()
        await one.connection.send(large, text=len(large) > 100)
        assert await one.until_closed() in (1009, 4400)
    channel = await scene.agent.open_video()
    await channel.send(b"\x01" * 300_000)
    await until(lambda: channel.close_code == 1009, what="the end of the channel")


async def test_a_flood_of_units_does_not_go_on_by_coming_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Almost no refill: what a slow machine sends in its time must not pass for a fair rate.
    monkeypatch.setattr(drone_video, "UNITS_PER_S", 10.0)

    async def flood(scene: Scene, count: int) -> int:
        """Returns how many units were accepted before the channel was closed."""
        channel = await scene.agent.open_video()
        answered = len(scene.agent.got)
        with contextlib.suppress(ConnectionClosed):
            for number in range(count):
                await scene.agent.send(key=number == 0, size=188)
        await until(lambda: channel.close_code == FLOODING, what="the end of the flood")
        return len(scene.agent.got) - answered

    async with start_tower(tmp_path) as world:
        scene = Scene(world)
        async with scene.stack:
            await scene.set_up()
            assert await flood(scene, 3 * round(UNITS_BURST)) >= UNITS_BURST
            assert await flood(scene, round(UNITS_BURST)) < UNITS_BURST


async def test_more_streams_than_a_user_may_have(tmp_path: Path) -> None:
    async with start_tower(tmp_path, user_video_sockets=2) as world:
        scene = Scene(world)
        async with scene.stack:
            await scene.set_up()
            kept = [await scene.watch() for _ in range(2)]
            for one in kept:
                await one.until(one.states)
            third = await scene.watch()
            assert await third.until_closed() == 4430


@contextlib.asynccontextmanager
async def throttled(watcher: Watcher, bytes_per_s: float) -> AsyncIterator[None]:
    watcher.bytes_per_s = bytes_per_s
    yield
    watcher.bytes_per_s = None


async def test_a_throttled_viewer_is_never_late_recovers_and_disturbs_nobody(scene: Scene) -> None:
    """A third of the bit rate: 24 pictures of 2 to 7 kB are 58 kB/s."""
    slow = await scene.watch(receive_buffer=2_048)
    fast = await scene.watch()
    await scene.agent.open_video()
    await scene.clock_known()
    async with filming(scene.agent):
        await fast.until(lambda: len(fast.units) > 24)
        began = time.monotonic()
        async with throttled(slow, 58_000 / 3):
            await asyncio.sleep(6)
        ended = time.monotonic()
        during = slow.delays_s(began)
        await asyncio.sleep(4)
    # Everything runs in this process: the machine's own delay is the other viewer's delay.
    machine_s = max(fast.delays_s(began))
    assert len(during) > 12
    assert max(during) < 1.0 + machine_s
    after = slow.delays_s(ended + 2.0)
    assert len(after) > 20
    assert sorted(after)[len(after) * 9 // 10] < 1.0
    undisturbed = fast.delays_s(began)
    assert sorted(undisturbed)[len(undisturbed) * 9 // 10] < 1.0
    follows = True
    for before, unit in zip(slow.units, slow.units[1:], strict=False):
        follows = follows and (unit.key or unit.sequence == before.sequence + 1)
    assert follows, "what cannot be decoded was sent"
    assert slow.skipped() > 40
    assert fast.skipped() < slow.skipped() / 5
