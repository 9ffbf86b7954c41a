"""How recorded flights stay and go: deletion, a disk that fails, a crash, budgets, backups."""

import asyncio
import io
import os
from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path

import pytest
from control_world import audit, live, until
from flight_scene import FlightScene
from test_server_metrics import SECRET, bearer, figures
from tower_world import assert_problem, start_tower

from server.flights.core import recorder
from server.flights.core.tlog import read_entries
from server.flights.store import service, writer
from server.flights.store.tables import FlightRow

AFTER_S = 0.3


@pytest.fixture(autouse=True)
def _land_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "AFTER_S", AFTER_S)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[FlightScene]:
    async with start_tower(tmp_path, metrics_token=SECRET) as world:
        scene = FlightScene(world)
        await scene.begin()
        yield scene


async def test_an_admin_deletes_a_flight_and_the_trail_says_so(scene: FlightScene) -> None:
    flight = await scene.whole()
    assert scene.files == [".jsonl", ".tlog"]
    assert (await scene.admin.delete(f"/api/v1/flights/{flight['id']}")).status_code == 204
    assert scene.files == []
    assert_problem(await scene.admin.get(f"/api/v1/flights/{flight['id']}"), 404, "unknown-flight")
    assert_problem(await scene.admin.delete(f"/api/v1/flights/{flight['id']}"), 404, "unknown-flight")
    (row,) = await audit(scene.admin, "flight.")
    assert (row["action"], row["actor_name"], row["detail"]["flight"]) == ("flight.deleted", "root", flight["id"])


async def test_a_deleted_drone_takes_its_flights_along(scene: FlightScene) -> None:
    await scene.whole()
    await scene.arm()
    scene.positions(3)
    assert (await scene.admin.delete(scene.path)).status_code == 204
    await until("its flight to end", lambda: scene.world.tower.hub.flights.running == 0)
    # Those of the flight before go with the next start.
    await until("the files of the last flight to go", lambda: len(scene.files) == 2)
    assert await scene.flights(scene.admin) == []


async def test_a_disk_that_fails_stops_recording_and_nothing_else(
    scene: FlightScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service, "TRY_AGAIN_AFTER_S", 0.5)
    await scene.arm()
    scene.positions(5)
    tower = scene.world.tower
    await until("the frames to be written", lambda: tower.flights.writer.frames_written >= 5)

    def fail(descriptor: int, piece: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tower.flights.writer, "_write", fail)
    scene.positions(20)
    await until("the flight to end", lambda: tower.hub.flights.counts["ended"] == 1)
    counted = await figures(await scene.world.client(), **bearer(SECRET))
    assert counted["tower_flights_failing"] == 1
    assert sum(counted[f"tower_flight_frames_total[end={end}]"] for end in ("not_written", "no_room")) >= 20
    # The flight goes on: telemetry arrives and commands pass.
    async with live(scene.world, scene.holder) as browser:
        await browser.socket.send(b"")
        assert (await scene.holder.post(f"{scene.path}/commands", json={"command": "hold"})).status_code == 200
    monkeypatch.setattr(tower.flights.writer, "_write", os.write)
    await until("recording to go on", lambda: tower.hub.flights.counts["begun"] >= 2)
    scene.positions(5)
    await scene.land()
    found = await scene.ready(2)
    assert [one["state"] for one in found] == ["ready", "ready"]
    assert found[-1]["words"] == writer.FULL
    assert found[-1]["lost_frames"] >= 20
    assert found[0]["words"] == ""


async def test_what_a_crash_left_is_closed_at_the_next_start(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = FlightScene(world)
        await scene.begin()
        await scene.arm()
        scene.positions(50)
        await until("it to be on the disk", lambda: world.tower.flights.writer.frames_written >= 50)
        folder = world.settings.files / "flights" / f"drone-{scene.drone.id}"
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        row = await scene.listed()
    # As if the process had been killed then, in the middle of a write; and a second flight without a row.
    for name, content in before.items():
        (folder / name).write_bytes(content + content[:11] * name.endswith("tlog") + b'{"at_us":1' * name.endswith("l"))
        (folder / f"{'b' * 16}{Path(name).suffix}").write_bytes(content)
    stranger = folder.with_name("drone-999")
    stranger.mkdir()
    for name, content in before.items():
        (stranger / f"{'c' * 16}{Path(name).suffix}").write_bytes(content)
    async with start_tower(tmp_path) as world:
        scene.world = world
        scene.holder = await world.signed_in("alice")
        first, second = await scene.ready(2)
        for flight in (first, second):
            assert (flight["words"], flight["frames"]) == (service.CRASHED, 52)
            tlog = await scene.holder.get(f"/api/v1/flights/{flight['id']}/tlog")
            entries = list(read_entries(io.BytesIO(tlog.content)))
            assert (len(entries), entries[-1].end) == (52, len(tlog.content))
            assert (await scene.holder.get(f"/api/v1/flights/{flight['id']}")).json()["index"]
        assert row["id"] in (first["id"], second["id"])
        assert [one.drone_id for one in world.tower.flights.quota.strays] == [999]


async def test_an_owner_pushes_out_only_his_own_flights(tmp_path: Path) -> None:
    async with start_tower(tmp_path, flights_budget_mb=1) as world:
        scene = FlightScene(world)
        await scene.begin()
        hers = await world.add_drone("hers", await world.add_user("carla"))
        async with world.database.writing() as session:
            for number in range(10):
                session.add(
                    FlightRow(
                        drone_id=hers.id if number < 3 else scene.drone.id,
                        store=world.tower.flights.files.id,
                        file=f"f{number}",
                        state="ready",
                        words="",
                        began_at=world.clock() - timedelta(days=100 - number),
                        ended_at=world.clock(),
                        size_bytes=150_000,
                        track=[],
                    )
                )
        over = await world.tower.flights.quota.make_space({})
        assert over == frozenset()
        kept = [one["drone"] for one in await scene.flights(scene.admin)]
        assert (kept.count("hers"), kept.count("kestrel")) == (3, 3)
        # A flight that runs beyond the share of its owner ends; one of the other goes on.
        over = await world.tower.flights.quota.make_space({scene.drone.id: 900_000, hers.id: 1000})
        assert over == {scene.drone.id}
        kept = [one["drone"] for one in await scene.flights(scene.admin)]
        assert kept == ["hers"] * 3
        assert {one["action"] for one in await audit(scene.admin, "flight.")} == {"flight.removed"}


async def test_flights_are_in_a_backup(scene: FlightScene) -> None:
    from server.backup.store.archive import ArchiveReader
    from server.backup.store.backup import make_backup

    flight = await scene.whole()
    archive = scene.world.settings.var / "backup.tar"
    await make_backup(scene.world.database, archive, files=scene.world.settings.files, keys="", clock=scene.world.clock)
    with ArchiveReader(archive) as reader:
        manifest = reader.check()
    assert manifest.tables["flights"] == 1
    assert manifest.tables["flight_pilots"] == 1
    sizes = [one.size_bytes for name, one in manifest.members.items() if name.startswith("files/flights/drone-")]
    assert sum(sizes) == flight["size_bytes"]


async def test_without_the_setting_no_flight_is_recorded(tmp_path: Path) -> None:
    async with start_tower(tmp_path, record_flights=False) as world:
        scene = FlightScene(world)
        await scene.begin()
        scene.agent.state(armed=True, airborne=True)
        scene.positions(10)
        await asyncio.sleep(1.2)  # two looks of the recorder
        assert await scene.flights() == []
        assert scene.files == []
