"""Conditions that end a recording or refuse it: limits, slow and full disks, the storage budget."""

import asyncio
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from control_world import audit, live
from recording_scene import RecordingScene
from sqlalchemy import event, insert
from tower_world import assert_problem, start_tower
from worlds.camera_units import units

from server.kernel.shares import ShareName
from server.link.core import flood_gate
from server.storage import file_budget
from server.video.store import service
from server.video.store.capture import TOO_LARGE, TOO_SLOW, UnitWriter
from server.video.store.quota import AT_ONCE
from server.video.store.service import NOTHING_CAME, TOO_LONG
from server.video.store.tables import RecordingRow
from wire.video import Codec, Quality

_COLUMNS = [column.name for column in RecordingRow.__table__.columns]


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[RecordingScene]:
    async with start_tower(tmp_path) as world:
        scene = RecordingScene(world)
        await scene.begin()
        yield scene


async def test_limits_end_it_with_words(scene: RecordingScene) -> None:
    service = scene.world.tower.recordings.service
    begun = await scene.record(quality="medium")
    scene.send()
    service._largest_bytes = 10_000
    large = await scene.record(quality="low")
    now = time.monotonic_ns() // 1000
    scene.video.send(
        scene.drone.id, units(Codec.H264, [now + 40_000 * number for number in range(50)], quality=Quality.LOW)
    )
    assert (await scene.came_to(large["id"], "ready"))["words"] == TOO_LARGE
    assert (await scene.get(large["id"]))["size_bytes"] < 40_000
    await service.tick(time.monotonic() + 601)
    assert (await scene.came_to(begun["id"], "ready", "failed"))["words"] == NOTHING_CAME
    longest = await scene.record(quality="high")
    service._longest_s = 0.0
    await service.tick(time.monotonic())
    assert (await scene.came_to(longest["id"], "failed", "finishing"))["state"] in ("failed", "finishing")
    reported = [one["detail"].get("words", "") for one in await audit(scene.admin, "recording.ended")]
    assert reported == [TOO_LONG, NOTHING_CAME, TOO_LARGE]


async def test_no_more_than_so_many_at_a_time(scene: RecordingScene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "MAX_RUNNING", 1)
    await scene.record()
    assert_problem(
        await scene.holder.post(f"{scene.path}/recordings", json={"quality": "low"}), 409, "too-many-recordings"
    )


async def test_who_begins_without_end_has_to_wait(scene: RecordingScene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flood_gate, "RECORDINGS_PER_S", 1e-6)
    monkeypatch.setattr(flood_gate, "OPERATIONS_REFILLED_IN_S", 1e9)
    scene.world.tower.hub.state.shares.apply({ShareName.RECORDINGS: 2, ShareName.OPERATIONS: 3})
    for _ in range(2):
        await scene.stop((await scene.record())["id"])
    path = f"{scene.path}/recordings"
    assert_problem(await scene.holder.post(path), 429, "too-many-operations")
    admins = await scene.record(scene.admin)
    assert (await scene.stop(admins["id"]))["ended_at"] is not None
    assert_problem(await scene.holder.post(f"{path}/{admins['id']}/stop"), 429, "too-many-operations")
    hub = scene.world.tower.hub
    assert hub.flood.admits_operation(scene.alice.id, time.monotonic(), stops=True), (
        "holding and landing have their own"
    )


async def test_a_slow_disk_ends_the_recording_and_never_waits(
    scene: RecordingScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread blocks in its first sync; units continue to arrive."""
    goes_on = threading.Event()
    monkeypatch.setattr(UnitWriter, "_sync", lambda self, *, at_least_s: goes_on.wait(60))
    monkeypatch.setattr(UnitWriter.__init__, "__kwdefaults__", {"most_waiting_bytes": 15_000})
    begun = await scene.record()
    now = time.monotonic_ns() // 1000
    started = time.perf_counter()
    scene.video.send(scene.drone.id, units(Codec.H264, [now + 40_000 * number for number in range(100)]))
    assert time.perf_counter() - started < 20
    running = scene.world.tower.recordings.service.waiting_bytes()
    assert 0 < running <= 15_000
    goes_on.set()
    ready = await scene.came_to(begun["id"], "ready", "failed")
    assert (ready["state"], ready["words"]) == ("ready", TOO_SLOW)
    assert 0 < ready["pictures"] < 100


async def test_a_full_disk_ends_it_and_refuses_the_next(scene: RecordingScene, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = await scene.record()
    scene.send()
    monkeypatch.setattr(file_budget, "MIN_FREE_BYTES", 1 << 62)
    service, soon = scene.world.tower.recordings.service, time.monotonic() + 10
    await asyncio.gather(*(service.tick(soon) for _ in range(2)))  # the tower's own tick may come at the same time
    failed = await scene.came_to(begun["id"], "failed")
    assert "no room" in failed["words"]
    assert scene.files == [".units"]
    assert_problem(await scene.holder.post(f"{scene.path}/recordings"), 413, "no-room")


async def test_the_oldest_go_when_the_budget_is_used_up(scene: RecordingScene) -> None:
    quota = scene.world.tower.recordings.quota
    first, second = await scene.whole(), await scene.whole()
    begun = await scene.record(quality="high")
    quota.budget_bytes = first["size_bytes"] + second["size_bytes"] + 100
    async with live(scene.world, scene.watcher) as browser:
        assert await quota.make_space(first["size_bytes"])
        assert (await browser.event("recording", event="removed"))["recording"]["id"] == first["id"]
    kept = [one["id"] for one in (await scene.watcher.get(f"{scene.path}/recordings")).json()]
    assert kept == [begun["id"], second["id"]]
    assert scene.files == [".mp4", ".units"]
    noted = await audit(scene.admin, "recording.removed")
    assert [one["detail"]["recording"] for one in noted] == [first["id"]]
    # A running recording is never removed. Nothing else can make room, so it ends.
    quota.budget_bytes = 5
    await scene.world.tower.recordings.service.tick(time.monotonic() + 10)
    ended = await scene.came_to(begun["id"], "failed", "finishing")
    assert ended["state"] in ("failed", "finishing")
    assert [one["id"] for one in (await scene.watcher.get(f"{scene.path}/recordings")).json()] == [begun["id"]]


async def test_however_many_are_kept_few_are_looked_at_together(scene: RecordingScene) -> None:
    tower = scene.world.tower
    first = await scene.whole()
    async with tower.database.writing() as session:
        row = await session.get(RecordingRow, first["id"])
        assert row is not None
        same = {name: getattr(row, name) for name in _COLUMNS if name != "id"}
        await session.execute(insert(RecordingRow), [same | {"file": f"{number:016x}"} for number in range(AT_ONCE)])
    quota, loaded = tower.recordings.quota, Counter[str]()

    def load(row: RecordingRow, _context: Any) -> None:
        loaded[row.file] += 1

    event.listen(RecordingRow, "load", load)
    try:
        assert await quota.make_space(0)
        assert not loaded, "room is made without a look at each"
        quota.budget_bytes = quota.kept_bytes - 1
        assert await quota.make_space(0)
        assert len(loaded) == AT_ONCE
        quota.budget_bytes = first["size_bytes"]
        assert await quota.make_space(0)
    finally:
        event.remove(RecordingRow, "load", load)
    kept = [one["id"] for one in (await scene.watcher.get(f"{scene.path}/recordings")).json()]
    assert kept == [first["id"] + AT_ONCE], "the newest"
