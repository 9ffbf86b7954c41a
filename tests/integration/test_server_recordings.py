"""Recordings over REST and on `/live`: who may, what is told, how they end, and what is kept of them."""

import asyncio
import errno
import json
import os
import subprocess
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ask, audit, live, until
from flying_scene import Scene
from sqlalchemy import event, insert
from tower_world import assert_problem, start_tower
from worlds.camera_units import units
from worlds.recorded_video import VideoByHand

from server.live.relay import flood_gate
from server.live.video.situation import VideoCondition
from server.live.video.streams import StreamKey
from server.store import file_budget
from server.store.recordings import service
from server.store.recordings.capture import TOO_LARGE, TOO_SLOW, UnitWriter
from server.store.recordings.finisher import CannotFinish
from server.store.recordings.quota import AT_ONCE
from server.store.recordings.service import NO_STORE, NOT_HERE, NOTHING_CAME, TOO_LONG
from server.store.recordings.tables import RecordingRow
from wire.control_messages import AutopilotState
from wire.video import Codec, Quality

US = 1_000_000
_COLUMNS = [column.name for column in RecordingRow.__table__.columns]


class RecordingScene(Scene):
    """With a camera whose units the test sends."""

    async def begin(self) -> None:
        await super().begin()
        self.video = VideoByHand()
        self.world.tower.recordings.service.video = self.video

    async def record(self, client: httpx.AsyncClient | None = None, **body: Any) -> dict[str, Any]:
        answer = await (client or self.holder).post(f"{self.path}/recordings", json=body)
        assert answer.status_code == 201, answer.text
        begun: dict[str, Any] = answer.json()
        return begun

    async def stop(self, recording_id: int) -> dict[str, Any]:
        answer = await self.holder.post(f"{self.path}/recordings/{recording_id}/stop")
        assert answer.status_code == 200, answer.text
        ended: dict[str, Any] = answer.json()
        return ended

    async def get(self, recording_id: int) -> dict[str, Any]:
        answer = await self.watcher.get(f"{self.path}/recordings/{recording_id}")
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found

    async def came_to(self, recording_id: int, *states: str) -> dict[str, Any]:
        """Waits for its end."""
        async for found in self._looks(recording_id):
            if found["state"] in states:
                return found
        raise AssertionError(f"it did not come to be {states}: {await self.get(recording_id)}")

    async def shows(self, recording_id: int, flights: int) -> list[str]:
        """Waits until it says that it shows so many."""
        async for found in self._looks(recording_id):
            if len(found["flights"]) == flights:
                return list(found["flights"])
        raise AssertionError(f"no {flights} flights: {await self.get(recording_id)}")

    async def _looks(self, recording_id: int) -> AsyncIterator[dict[str, Any]]:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            yield await self.get(recording_id)
            await asyncio.sleep(0.05)

    async def whole(self, *, codec: Codec = Codec.H264, pictures: int = 12) -> dict[str, Any]:
        """A recording that is ready."""
        begun = await self.record()
        self.send(codec=codec, pictures=pictures)
        await self.stop(begun["id"])
        return await self.came_to(begun["id"], "ready", "failed")

    def send(self, *, codec: Codec = Codec.H264, pictures: int = 12) -> None:
        begun = time.monotonic_ns() // 1000
        self.video.send(self.drone.id, units(codec, [begun + 40_000 * number for number in range(pictures)], group=6))

    @property
    def files(self) -> list[str]:
        folder = self.world.settings.files / "recordings" / f"drone-{self.drone.id}"
        return sorted(path.suffix for path in folder.iterdir()) if folder.is_dir() else []


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[RecordingScene]:
    async with start_tower(tmp_path) as world:
        scene = RecordingScene(world)
        await scene.begin()
        yield scene


async def test_what_is_recorded_can_be_downloaded(scene: RecordingScene, tmp_path: Path) -> None:
    async with live(scene.world, scene.watcher) as browser:
        begun = await scene.record()
        assert begun | {"began_at": ""} == {
            "id": begun["id"],
            "drone_id": scene.drone.id,
            "by": {"id": scene.alice.id, "name": "alice"},
            "state": "recording",
            "words": "",
            "quality": "medium",
            "codec": "h264",
            "began_at": "",
            "ended_at": None,
            "flights": [],
            "size_bytes": begun["size_bytes"],
            "duration_s": None,
            "pictures": 0,
            "width": None,
            "height": None,
        }
        assert (await browser.event("recording", event="begun"))["recording"] == begun
        scene.send(pictures=24)
        going_on = await scene.get(begun["id"])
        assert (going_on["state"], going_on["pictures"]) == ("recording", 24)
        assert going_on["size_bytes"] > begun["size_bytes"]
        assert_problem(
            await scene.watcher.get(f"{scene.path}/recordings/{begun['id']}/file"), 409, "recording-not-ready"
        )
        ended = await scene.stop(begun["id"])
        assert ended["state"] in ("finishing", "ready")
        assert ended["ended_at"] >= ended["began_at"]
        ready = (await browser.event("recording", event="ready"))["recording"]
    assert (ready["state"], ready["words"], ready["pictures"], ready["width"]) == ("ready", "", 24, 320)
    assert ready["duration_s"] == pytest.approx(0.96, abs=0.05)
    assert (await scene.watcher.get(f"{scene.path}/recordings")).json() == [ready]
    file = await scene.watcher.get(f"{scene.path}/recordings/{ready['id']}/file")
    assert (file.status_code, file.headers["content-type"], len(file.content)) == (
        200,
        "video/mp4",
        ready["size_bytes"],
    )
    assert file.headers["content-disposition"].startswith('attachment; filename="kestrel-20')
    told = _probe(tmp_path, file.content)
    assert (told["codec_name"], told["nb_read_frames"]) == ("h264", "24")
    assert float(told["duration"]) == pytest.approx(0.96, abs=0.05)
    assert scene.files == [".mp4"]
    actions = [
        (one["action"], one["actor"]["name"] if one.get("actor") else "")
        for one in await audit(scene.admin, "recording.")
    ]
    assert [action for action, _ in actions] == ["recording.ended", "recording.began"]


def _probe(tmp_path: Path, content: bytes) -> dict[str, Any]:
    path = tmp_path / "downloaded.mp4"
    path.write_bytes(content)
    asked = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", str(path)]
    answer = subprocess.run(asked, capture_output=True, text=True, check=True, timeout=60)
    assert answer.stderr == ""
    told: dict[str, Any] = json.loads(answer.stdout)["streams"][0]
    return told


async def test_a_part_of_the_file_can_be_asked_for(scene: RecordingScene) -> None:
    ready = await scene.whole()
    path = f"{scene.path}/recordings/{ready['id']}/file"
    whole = (await scene.watcher.get(path)).content
    part = await scene.watcher.get(path, headers={"Range": "bytes=100-299"})
    assert (part.status_code, part.content) == (206, whole[100:300])
    assert part.headers["content-range"] == f"bytes 100-299/{len(whole)}"
    rest = await scene.watcher.get(path, headers={"Range": "bytes=300-"})
    assert part.content + rest.content == whole[100:]
    assert (await scene.watcher.get(path, headers={"Range": f"bytes={len(whole)}-"})).status_code == 416


async def test_mpeg1_becomes_h264(scene: RecordingScene, tmp_path: Path) -> None:
    scene.video.watched = {StreamKey(Quality.MEDIUM, Codec.MPEG1)}
    ready = await scene.whole(codec=Codec.MPEG1)
    assert (ready["state"], ready["codec"], ready["pictures"]) == ("ready", "mpeg1", 12)
    file = await scene.watcher.get(f"{scene.path}/recordings/{ready['id']}/file")
    assert _probe(tmp_path, file.content)["codec_name"] == "h264"


async def test_the_stream_that_runs_already_is_the_one_that_is_recorded(scene: RecordingScene) -> None:
    scene.video.watched = {StreamKey(Quality.LOW, Codec.H264), StreamKey(Quality.HIGH, Codec.MPEG1)}
    best = await scene.record()
    assert (best["quality"], best["codec"]) == ("high", "mpeg1")
    low = await scene.record(quality="low")
    assert (low["quality"], low["codec"]) == ("low", "h264")
    other = await scene.record(quality="medium")
    assert (other["quality"], other["codec"]) == ("medium", "h264")
    assert_problem(
        await scene.holder.post(f"{scene.path}/recordings", json={"quality": "low"}), 409, "already-recording"
    )
    assert_problem(
        await scene.holder.post(f"{scene.path}/recordings", json={"quality": "best"}), 422, "invalid-request"
    )
    assert_problem(await scene.holder.post(f"{scene.path}/recordings", json={"qualty": "low"}), 422, "invalid-request")
    await scene.stop(low["id"])
    assert scene.video.wanted(scene.drone.id) - scene.video.watched == {StreamKey(Quality.MEDIUM, Codec.H264)}
    await scene.record(quality="low")


async def test_only_the_holder_and_admins_begin_and_end(scene: RecordingScene) -> None:
    path = f"{scene.path}/recordings"
    assert_problem(await scene.watcher.post(path), 409, "not-in-control")
    stranger = await scene.world.signed_in(await scene.world.add_user("mallory"))
    begun = await scene.record()
    for method, ending in (
        ("GET", ""),
        ("POST", ""),
        ("GET", "/1"),
        ("POST", "/1/stop"),
        ("GET", "/1/file"),
        ("DELETE", "/1"),
    ):
        there = await stranger.request(method, path + ending)
        nowhere = await stranger.request(method, f"/api/v1/drones/999/recordings{ending}")
        assert_problem(there, 404, "unknown-drone")
        assert there.json() | {"instance": ""} == nowhere.json() | {"instance": ""}
    assert_problem(await scene.watcher.post(f"{path}/{begun['id']}/stop"), 409, "not-in-control")
    assert (await scene.admin.post(f"{path}/{begun['id']}/stop")).status_code == 200
    await scene.record(scene.admin)
    # The recording goes on without its holder.
    assert (await ask(scene.holder, scene.drone.id, "release")).status_code == 200
    assert_problem(await scene.holder.post(f"{path}/{begun['id']}/stop"), 409, "not-in-control")
    assert len(scene.video.sinks) == 1


async def test_what_never_was_and_what_is_of_another_drone_are_the_same(scene: RecordingScene) -> None:
    ready = await scene.whole()
    crow = await scene.world.add_drone("crow", scene.alice)
    for path in (f"{scene.path}/recordings/999", f"/api/v1/drones/{crow.id}/recordings/{ready['id']}"):
        for method, ending in (("GET", ""), ("GET", "/file"), ("DELETE", "")):
            assert_problem(await scene.holder.request(method, path + ending), 404, "unknown-recording")
    assert scene.files == [".mp4"]


@pytest.mark.parametrize("taken", [{"watch": False}, {"video": "move"}], ids=["view", "video"])
async def test_from_whom_the_video_was_taken_the_recordings_are_too(
    scene: RecordingScene, taken: dict[str, Any]
) -> None:
    ready = await scene.whole()
    async with live(scene.world, scene.holder) as shut_out, live(scene.world, scene.watcher) as other:
        assert (await ask(scene.admin, scene.drone.id, "take", reason="mine", **taken)).status_code == 200
        for ending in ("", f"/{ready['id']}", f"/{ready['id']}/file"):
            assert_problem(await scene.holder.get(f"{scene.path}/recordings{ending}"), 403, "view-taken")
        assert_problem(await scene.holder.delete(f"{scene.path}/recordings/{ready['id']}"), 403, "view-taken")
        await scene.record(scene.admin)
        await other.event("recording", event="begun")
        # What would have been told before is not there once something told later is.
        assert (await ask(scene.admin, scene.drone.id, "give")).status_code == 200
        await shut_out.event("control", event="given")
        assert [one for one in shut_out.events if one["type"] == "recording"] == []
    assert (await scene.holder.get(f"{scene.path}/recordings/{ready['id']}/file")).status_code == 200


async def test_an_owner_or_an_admin_deletes_with_a_note(scene: RecordingScene) -> None:
    first, second = await scene.whole(), await scene.whole()
    carol = await scene.lend_to_carol()
    assert_problem(await carol.delete(f"{scene.path}/recordings/{first['id']}"), 403, "not-your-recording")
    async with live(scene.world, scene.watcher) as browser:
        assert (await scene.watcher.delete(f"{scene.path}/recordings/{first['id']}")).status_code == 204
        assert (await browser.event("recording", event="removed"))["recording"]["id"] == first["id"]
    assert (await scene.admin.delete(f"{scene.path}/recordings/{second['id']}")).status_code == 204
    assert_problem(await scene.admin.delete(f"{scene.path}/recordings/{second['id']}"), 404, "unknown-recording")
    assert scene.files == []
    assert (await scene.watcher.get(f"{scene.path}/recordings")).json() == []
    noted = await audit(scene.admin, "recording.deleted")
    assert [one["detail"]["recording"] for one in noted] == [second["id"], first["id"]]


async def test_one_that_goes_on_is_not_deleted(scene: RecordingScene) -> None:
    begun = await scene.record()
    assert_problem(await scene.admin.delete(f"{scene.path}/recordings/{begun['id']}"), 409, "recording-busy")
    assert scene.files == [".units"]


async def test_a_drone_without_video_is_not_recorded(scene: RecordingScene) -> None:
    scene.video.condition, scene.video.words = VideoCondition.NO_CAMERA, "kestrel has no camera"
    answer = assert_problem(await scene.holder.post(f"{scene.path}/recordings"), 409, "no-video")
    assert answer["detail"] == "kestrel has no camera"
    scene.video.condition = VideoCondition.OFFLINE
    assert_problem(await scene.holder.post(f"{scene.path}/recordings"), 409, "drone-offline")
    assert (await scene.watcher.get(f"{scene.path}/recordings")).json() == []


async def test_nothing_came_so_there_is_no_file(scene: RecordingScene) -> None:
    begun = await scene.record()
    await scene.stop(begun["id"])
    failed = await scene.came_to(begun["id"], "failed")
    assert (failed["words"], failed["size_bytes"]) == ("not one picture came", 0)
    answer = assert_problem(
        await scene.holder.get(f"{scene.path}/recordings/{begun['id']}/file"), 409, "recording-not-ready"
    )
    assert answer["detail"] == "not one picture came"
    assert scene.files == []


async def test_it_says_which_flights_it_shows(scene: RecordingScene) -> None:
    hub = scene.world.tower.hub

    def flies(airborne: bool) -> None:
        told = AutopilotState(heard=True, armed=airborne, airborne=airborne)
        hub.report(scene.agent.link, told, at=scene.world.clock())

    flies(False)
    begun = await scene.record()
    scene.send()
    flies(True)
    first = hub.drone(scene.drone.id).view().airborne_since
    assert await scene.shows(begun["id"], 1) == [first.isoformat().replace("+00:00", "Z")]
    flies(False)
    scene.world.clock.advance(60)
    flies(True)
    both = await scene.shows(begun["id"], 2)
    ended = await scene.stop(begun["id"])
    assert ended["flights"] == both
    again = await scene.record()
    assert again["flights"] == both[1:]


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
    told = [one["detail"].get("words", "") for one in await audit(scene.admin, "recording.ended")]
    assert told == [TOO_LONG, NOTHING_CAME, TOO_LARGE]


async def test_no_more_than_so_many_at_a_time(scene: RecordingScene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "MAX_RUNNING", 1)
    await scene.record()
    assert_problem(
        await scene.holder.post(f"{scene.path}/recordings", json={"quality": "low"}), 409, "too-many-recordings"
    )


async def test_who_begins_without_end_has_to_wait(scene: RecordingScene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flood_gate, "RECORDINGS_BURST", 2)
    monkeypatch.setattr(flood_gate, "RECORDINGS_PER_S", 1e-6)
    monkeypatch.setattr(flood_gate, "OPERATIONS_BURST", 3)
    monkeypatch.setattr(flood_gate, "OPERATIONS_PER_S", 1e-6)
    for _ in range(2):
        await scene.stop((await scene.record())["id"])
    path = f"{scene.path}/recordings"
    assert_problem(await scene.holder.post(path), 429, "too-many-operations")
    admins = await scene.record(scene.admin)
    assert (await scene.stop(admins["id"]))["ended_at"] is not None
    assert_problem(await scene.holder.post(f"{path}/{admins['id']}/stop"), 429, "too-many-operations")
    hub = scene.world.tower.hub
    assert hub.admits_operation(scene.alice.id, time.monotonic(), stops=True), "holding and landing have their own"


async def test_a_slow_disk_ends_the_recording_and_never_waits(
    scene: RecordingScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread stands still in its first sync; the units go on coming."""
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
    await scene.world.tower.recordings.service.tick(time.monotonic() + 10)
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
        assert await quota.make_room(first["size_bytes"])
        assert (await browser.event("recording", event="removed"))["recording"]["id"] == first["id"]
    kept = [one["id"] for one in (await scene.watcher.get(f"{scene.path}/recordings")).json()]
    assert kept == [begun["id"], second["id"]]
    assert scene.files == [".mp4", ".units"]
    noted = await audit(scene.admin, "recording.removed")
    assert [one["detail"]["recording"] for one in noted] == [first["id"]]
    # One that goes on is never removed: nothing is left to make room with, so it ends.
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
        assert await quota.make_room(0)
        assert not loaded, "room is made without a look at each"
        quota.budget_bytes = quota.kept_bytes - 1
        assert await quota.make_room(0)
        assert len(loaded) == AT_ONCE
        quota.budget_bytes = first["size_bytes"]
        assert await quota.make_room(0)
    finally:
        event.remove(RecordingRow, "load", load)
    kept = [one["id"] for one in (await scene.watcher.get(f"{scene.path}/recordings")).json()]
    assert kept == [first["id"] + AT_ONCE], "the newest"


async def test_a_drone_that_is_deleted_leaves_no_files(scene: RecordingScene) -> None:
    await scene.whole()
    await scene.record()
    assert scene.files == [".mp4", ".units"]
    assert (await scene.admin.delete(scene.path)).status_code == 204
    await until("the end", lambda: scene.world.tower.recordings.service.running() == 0)
    await until("the files to go", lambda: not scene.files)


async def test_what_cannot_be_finished_is_kept_and_tried_again_at_the_next_start(tmp_path: Path) -> None:
    async def hangs(source: Path, target: Path) -> Any:
        raise CannotFinish("the program that makes the file hangs")

    async with start_tower(tmp_path) as world:
        scene = RecordingScene(world)
        await scene.begin()
        world.tower.recordings.finisher._make = hangs
        failed = await scene.whole()
        assert (failed["state"], failed["words"]) == ("failed", "the program that makes the file hangs")
        assert failed["size_bytes"] > 0
        assert scene.files == [".units"]
        person = scene.bob
    async with start_tower(tmp_path) as world:
        scene.world, scene.watcher = world, await world.signed_in(person)
        ready = await scene.came_to(failed["id"], "ready")
        assert (ready["words"], ready["pictures"]) == ("", 12)
        assert scene.files == [".mp4"]


async def test_a_tower_that_is_stopped_ends_what_goes_on_and_finishes_it_at_the_next_start(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = RecordingScene(world)
        await scene.begin()
        begun = await scene.record()
        scene.send()
        person, drone_id = scene.bob, scene.drone.id
    folder = world.settings.files / "recordings" / f"drone-{drone_id}"
    (folder / "0123456789abcdef.mp4.part").write_bytes(b"half of a file")
    (folder / "notes.mp4").write_bytes(b"somebody's own")
    async with start_tower(tmp_path) as world:
        scene.world, scene.watcher = world, await world.signed_in(person)
        ready = await scene.came_to(begun["id"], "ready")
        assert (ready["words"], ready["pictures"]) == ("the tower was stopped", 12)
        assert sorted(path.name for path in folder.iterdir())[1:] == ["notes.mp4"]


async def test_files_outlive_an_older_copy_of_the_database_and_go_by_their_age(tmp_path: Path) -> None:
    """Those of a drone that was deleted do not: the trail of the copy that is there says so."""
    async with start_tower(tmp_path) as world:
        scene = RecordingScene(world)
        await scene.begin()
        before = await scene.whole()
        folder, person = world.settings.files / "recordings", scene.bob
        other = await world.add_drone("merlin", scene.alice)
        assert (await scene.admin.delete(f"/api/v1/drones/{other.id}")).status_code == 204
    strays = [folder / f"drone-{scene.drone.id}" / f"{7:016x}.mp4", folder / "drone-999" / f"{8:016x}.units"]
    (folder / f"drone-{other.id}").mkdir()
    (folder / f"drone-{other.id}" / f"{9:016x}.mp4").write_bytes(bytes(500))
    for path, age_s in zip(strays, (3600, -3600), strict=True):
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(bytes(1000))
        os.utime(path, (time.time() - age_s,) * 2)
    async with start_tower(tmp_path) as world:
        scene.world, scene.watcher = world, await world.signed_in(person)
        assert not (folder / f"drone-{other.id}").exists()
        quota = world.tower.recordings.quota
        assert [one.path for one in quota.strays] == strays
        assert await quota.make_room(0)
        assert quota.kept_bytes == before["size_bytes"] + 2000
        quota.budget_bytes = quota.kept_bytes - 1
        assert await quota.make_room(0)
        assert [path.exists() for path in strays] == [False, True], "the oldest goes first"
        assert (await scene.get(before["id"]))["state"] == "ready"
        quota.budget_bytes = 1000
        assert await quota.make_room(0)
        assert (await scene.watcher.get(f"{scene.path}/recordings")).json() == []
        assert strays[1].exists(), "the newest of all stays, though the database does not know it"
        assert quota.kept_bytes == 1000


async def test_files_that_are_gone_or_elsewhere_are_not_promised(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = RecordingScene(world)
        await scene.begin()
        lost, kept = await scene.whole(), await scene.whole()
        person = scene.bob
        row_file = next((world.settings.files / "recordings").rglob("*.mp4"))
        async with world.database.reading() as session:
            row = await session.get(RecordingRow, lost["id"])
            assert row is not None
            row_file = row_file.with_name(f"{row.file}.mp4")
        row_file.unlink()
        answer = await scene.watcher.get(f"{scene.path}/recordings/{lost['id']}/file")
        assert_problem(answer, 404, "unknown-recording")
    async with start_tower(tmp_path) as world:
        scene.world, scene.watcher = world, await world.signed_in(person)
        assert (await scene.get(lost["id"]))["words"] == "its file is gone"
        assert (await scene.get(kept["id"]))["state"] == "ready"
    async with start_tower(tmp_path, files=tmp_path / "elsewhere") as world:
        scene.world, scene.watcher = world, await world.signed_in(person)
        found = await scene.get(kept["id"])
        assert (found["state"], found["words"]) == ("ready", NOT_HERE)
        assert (await scene.watcher.get(f"{scene.path}/recordings")).json()[0]["words"] == NOT_HERE
        answer = await scene.watcher.get(f"{scene.path}/recordings/{kept['id']}/file")
        assert assert_problem(answer, 409, "recording-not-ready")["detail"] == NOT_HERE


async def test_a_tower_whose_disk_is_full_flies_without_recordings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, text: str) -> None:
        path.touch()  # as the disk does: a file, and nothing in it
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", full)
        async with start_tower(tmp_path) as world:
            scene = RecordingScene(world)
            await scene.begin()
            answer = await scene.holder.post(f"{scene.path}/recordings")
            assert assert_problem(answer, 413, "no-room")["detail"] == NO_STORE
            assert (await scene.watcher.get(f"{scene.path}/recordings")).json() == []
            assert world.tower.recordings.service.running() == 0
    async with start_tower(tmp_path) as world:
        assert world.tower.recordings.store.id, "there was room again"
