"""Recordings over REST and on `/live`: who may record, download and delete, and what the file holds."""

import asyncio
import json
import subprocess
import time
from collections.abc import AsyncIterator
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from control_world import ask, audit, live
from recording_scene import RecordingScene
from tower_world import assert_problem, start_tower

from server.video.core.situation import VideoCondition
from server.video.core.streams import StreamKey
from wire.control_messages import AutopilotState
from wire.video import Codec, Quality

US = 1_000_000


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
            "first_picture_at": None,
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
    reported = _probe(tmp_path, file.content)
    assert (reported["codec_name"], reported["nb_read_frames"]) == ("h264", "24")
    assert float(reported["duration"]) == pytest.approx(0.96, abs=0.05)
    assert scene.files == [".mp4"]
    actions = [
        (one["action"], one["actor"]["name"] if one.get("actor") else "")
        for one in await audit(scene.admin, "recording.")
    ]
    assert [action for action, _ in actions] == ["recording.ended", "recording.began"]


async def test_a_camera_that_starts_late_gives_the_time_of_its_first_picture(scene: RecordingScene) -> None:
    asked_at_s = time.monotonic()
    begun = await scene.record()
    scene.world.clock.advance(7)
    began_at = datetime.fromisoformat(begun["began_at"])
    scene.send(pictures=24)
    busy_s = time.monotonic() - asked_at_s
    going_on = await scene.get(begun["id"])
    late_s = (datetime.fromisoformat(going_on["first_picture_at"]) - began_at).total_seconds()
    assert 6.9 < late_s < 7.1 + busy_s
    await scene.stop(begun["id"])
    ready = await scene.came_to(begun["id"], "ready")
    assert (ready["began_at"], ready["first_picture_at"]) == (begun["began_at"], going_on["first_picture_at"])


async def test_a_stream_that_runs_already_begins_before_its_recording(scene: RecordingScene) -> None:
    asked_at_s = time.monotonic()
    begun = await scene.record()
    busy_s = time.monotonic() - asked_at_s
    scene.send(pictures=24, since_us=time.monotonic_ns() // 1000 - 900_000)
    found = await scene.get(begun["id"])
    early = datetime.fromisoformat(begun["began_at"]) - datetime.fromisoformat(found["first_picture_at"])
    assert 0.8 - busy_s < early.total_seconds() < 1.0


def _probe(tmp_path: Path, content: bytes) -> dict[str, Any]:
    path = tmp_path / "downloaded.mp4"
    path.write_bytes(content)
    asked = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", str(path)]
    answer = subprocess.run(asked, capture_output=True, text=True, check=True, timeout=60)
    assert answer.stderr == ""
    reported: dict[str, Any] = json.loads(answer.stdout)["streams"][0]
    return reported


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
    # The recording continues without its holder.
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
        # Events arrive in order: when this later one is there, an earlier one would be too.
        assert (await ask(scene.admin, scene.drone.id, "give")).status_code == 200
        await shut_out.event("control", event="given")
        # That the first one is ready may come late, from the time before the take.
        recordings = [one["recording"]["id"] for one in shut_out.events if one["type"] == "recording"]
        assert set(recordings) <= {ready["id"]}
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
    assert (failed["words"], failed["size_bytes"]) == ("no picture came", 0)
    answer = assert_problem(
        await scene.holder.get(f"{scene.path}/recordings/{begun['id']}/file"), 409, "recording-not-ready"
    )
    assert answer["detail"] == "no picture came"
    assert scene.files == []


async def test_it_says_which_flights_it_shows(scene: RecordingScene) -> None:
    hub = scene.world.tower.hub

    def flies(airborne: bool) -> None:
        reported = AutopilotState(heard=True, armed=airborne, airborne=airborne)
        hub.reports.receive(scene.agent.link, reported, at=scene.world.clock())

    flies(False)
    begun = await scene.record()
    scene.send()
    flies(True)
    first = hub.state.drones.get(scene.drone.id).view().airborne_since
    assert await scene.shows(begun["id"], 1) == [first.isoformat().replace("+00:00", "Z")]
    flies(False)
    scene.world.clock.advance(60)
    flies(True)
    both = await scene.shows(begun["id"], 2)
    ended = await scene.stop(begun["id"])
    assert ended["flights"] == both
    again = await scene.record()
    assert again["flights"] == both[1:]


async def test_a_change_in_the_moment_of_the_end_keeps_nobody_waiting(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        service = world.tower.recordings.service
        work = asyncio.create_task(service.work())
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        service._something.set()
        await asyncio.sleep(0)  # its waiting is over, but it has not gone on
        work.cancel()
        done, _ = await asyncio.wait({work}, timeout=3.0)
        work.cancel()
        assert done == {work}
