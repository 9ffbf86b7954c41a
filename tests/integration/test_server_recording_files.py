"""Recording files across restarts, restores and deletions."""

import errno
import os
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from control_world import until
from recording_scene import RecordingScene
from tower_world import assert_problem, start_tower

from server.video.store.finisher import CannotFinish
from server.video.store.service import NO_STORE, NOT_HERE
from server.video.store.tables import RecordingRow


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[RecordingScene]:
    async with start_tower(tmp_path) as world:
        scene = RecordingScene(world)
        await scene.begin()
        yield scene


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
        await until("the units to go", lambda: scene.files == [".mp4"])


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
    """Files of a deleted drone are removed: the audit trail of the restored copy proves the deletion."""
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
        assert await quota.make_space(0)
        assert quota.kept_bytes == before["size_bytes"] + 2000
        quota.budget_bytes = quota.kept_bytes - 1
        assert await quota.make_space(0)
        assert [path.exists() for path in strays] == [False, True], "the oldest goes first"
        assert (await scene.get(before["id"]))["state"] == "ready"
        quota.budget_bytes = 1000
        assert await quota.make_space(0)
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
        path.touch()  # as the disk does: an empty file
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
