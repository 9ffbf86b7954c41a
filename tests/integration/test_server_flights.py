"""Recorded flights over REST: what other programs read of them, who may have them, and how they go."""

import asyncio
import io
import json
import os
import subprocess
import sys
from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import httpx
import pytest
from control_world import ask, audit, live, until
from flying_scene import Scene
from test_server_metrics import SECRET, bearer, figures
from tower_world import TowerWorld, assert_problem, start_tower

from server.domain.people import Role
from server.live.flights import recorder
from server.live.flights.tlog import read_entries
from server.store.flights import service, writer
from server.store.flights.tables import FlightRow
from wire.dialect import build, mavlink
from wire.tagged import tag

MAVLOGDUMP = Path(sys.executable).with_name("mavlogdump.py")
AFTER_S = 0.3


class FlightScene(Scene):
    """A drone whose flights are recorded."""

    async def begin(self) -> None:
        await super().begin()
        self.number = 0

    def positions(self, count: int = 10) -> None:
        """So many messages of the autopilot, along a line to the north."""
        for _ in range(count):
            self.number += 1
            at = 470_000_000 + self.number * 1000, 80_000_000, 520_000, 20_000
            self.agent.frame(mavlink.MAVLink_global_position_int_message(self.number, *at, 100, 0, 0, 9000))

    async def arm(self) -> None:
        running = self.world.tower.hub.flights.running
        self.agent.state(armed=True, airborne=True)
        await until("a flight to begin", lambda: self.world.tower.hub.flights.running == running + 1)

    async def land(self) -> None:
        self.agent.state(armed=False, airborne=False)
        await until("the flight to end", lambda: self.world.tower.hub.flights.running == 0)

    async def flights(self, client: httpx.AsyncClient | None = None, **query: Any) -> list[dict[str, Any]]:
        answer = await (client or self.holder).get("/api/v1/flights", params=query)
        assert answer.status_code == 200, answer.text
        found: list[dict[str, Any]] = answer.json()["flights"]
        return found

    async def listed(self) -> dict[str, Any]:
        """Waits until the flight that goes on is listed: its row is written in the background."""
        deadline = asyncio.get_running_loop().time() + 30
        while not (found := await self.flights()):
            assert asyncio.get_running_loop().time() < deadline
            await asyncio.sleep(0.05)
        return found[0]

    async def ready(self, count: int = 1) -> list[dict[str, Any]]:
        """Waits until so many flights can be downloaded."""
        deadline = asyncio.get_running_loop().time() + 30
        while True:
            found = await self.flights()
            if len(found) == count and all(one["state"] != "recording" for one in found):
                return found
            assert asyncio.get_running_loop().time() < deadline, found
            await asyncio.sleep(0.05)

    async def whole(self, frames: int = 10) -> dict[str, Any]:
        """Flies once."""
        before = len(await self.flights())
        await self.arm()
        self.positions(frames)
        await self.land()
        return (await self.ready(before + 1))[0]

    @property
    def files(self) -> list[str]:
        folder = self.world.settings.files / "flights" / f"drone-{self.drone.id}"
        return sorted(path.suffix for path in folder.iterdir()) if folder.is_dir() else []


@pytest.fixture(autouse=True)
def _land_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "AFTER_S", AFTER_S)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[FlightScene]:
    async with start_tower(tmp_path, metrics_token=SECRET) as world:
        scene = FlightScene(world)
        await scene.begin()
        yield scene


def dumped(path: Path) -> list[dict[str, Any]]:
    """What pymavlink's own program reads."""
    ran = subprocess.run(
        [sys.executable, str(MAVLOGDUMP), "--format=json", str(path)],
        capture_output=True,
        text=True,
        env=os.environ | {"MAVLINK20": "1"},
        timeout=60,
        check=True,
    )
    return [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]


async def test_mavlogdump_reads_every_frame_that_the_tower_relayed(scene: FlightScene, tmp_path: Path) -> None:
    scene.positions(5)  # before arming
    await scene.arm()
    async with live(scene.world, scene.holder) as browser:
        for number in range(20):
            scene.positions(10)
            stick = mavlink.MAVLink_manual_control_message(1, number, 0, 500, 0, 0)
            frame = build(stick, system_id=255, component_id=190, sequence=number)
            await browser.socket.send(tag(scene.drone.id, frame))
        hub = scene.world.tower.hub
        await until("the sticks to pass", lambda: hub.state.traffic.frames_to_agents >= 20)
    await scene.land()
    (flight,) = await scene.ready()
    counted = await figures(await scene.world.client(), **bearer(SECRET))
    relayed = sum(counted[f"tower_frames_total[direction={way},peer=agent]"] for way in ("in", "out"))
    assert counted["tower_flight_frames_total[end=recorded]"] == relayed
    answer = await scene.watcher.get(f"/api/v1/flights/{flight['id']}/tlog")
    assert (answer.status_code, flight["frames"], flight["lost_frames"]) == (200, relayed, 0)
    assert answer.headers["content-disposition"].startswith('attachment; filename="kestrel-20')
    file = tmp_path / "flight.tlog"
    file.write_bytes(answer.content)
    messages = dumped(file)
    assert len(messages) == relayed
    kinds = [one["meta"]["type"] for one in messages]
    assert (kinds.count("GLOBAL_POSITION_INT"), kinds.count("MANUAL_CONTROL")) == (205, 20)
    assert "BAD_DATA" not in kinds
    # In the order and with the content in which they passed.
    boots = [one["data"]["time_boot_ms"] for one in messages if one["meta"]["type"] == "GLOBAL_POSITION_INT"]
    assert boots == list(range(1, 206))
    times = [one["meta"]["timestamp"] for one in messages]
    assert times == sorted(times)
    began = scene.world.clock() - timedelta(seconds=60)
    assert began.timestamp() < times[0] <= times[-1] < scene.world.clock().timestamp()


async def test_a_flight_is_listed_with_its_pilots_its_way_and_its_index(scene: FlightScene) -> None:
    await scene.arm()
    scene.positions(101)
    running = await scene.listed()
    assert (running["state"], running["pilots"]) == ("recording", [{"id": scene.alice.id, "name": "alice"}])
    assert_problem(await scene.holder.get(f"/api/v1/flights/{running['id']}/tlog"), 409, "flight-running")
    assert_problem(await scene.admin.delete(f"/api/v1/flights/{running['id']}"), 409, "flight-running")
    await scene.holder.post(f"{scene.path}/commands", json={"command": "hold"})
    assert (await ask(scene.admin, scene.drone.id, "take")).status_code == 200
    await until("the index to be written", lambda: scene.world.tower.flights.writer.waiting_bytes == 0)
    half = (await scene.holder.get(f"/api/v1/flights/{running['id']}")).json()
    assert {"armed", "control"} <= {one["kind"] for one in half["index"]}
    await scene.land()
    (flight,) = await scene.ready()
    assert flight | {"began_at": "", "ended_at": "", "duration_s": 0, "size_bytes": 0, "frames": 0, "track": []} == {
        "id": running["id"],
        "drone_id": scene.drone.id,
        "drone": "kestrel",
        "pilots": [{"id": scene.alice.id, "name": "alice"}, {"id": scene.root.id, "name": "root"}],
        "state": "ready",
        "words": "",
        "began_at": "",
        "ended_at": "",
        "duration_s": 0,
        "distance_m": pytest.approx(100 * 11.13, rel=0.01),
        "max_height_m": 20.0,
        "track": [],
        "frames": 0,
        "lost_frames": 0,
        "size_bytes": 0,
    }
    assert 0 < flight["duration_s"] < 60
    assert len(flight["track"]) > 10
    detail = (await scene.holder.get(f"/api/v1/flights/{flight['id']}")).json()
    assert detail["index_is_whole"] is True
    kinds = [one["kind"] for one in detail["index"]]
    assert {"armed", "command", "control", "hold", "link", "disarmed", "end"} <= set(kinds)
    assert [one["at_us"] for one in detail["index"]] == sorted(one["at_us"] for one in detail["index"])
    (taken,) = [one for one in detail["index"] if one["kind"] == "control" and one["event"] == "taken"]
    assert (taken["holder"]["name"], taken["by"]["name"]) == ("root", "root")
    commands = [one for one in detail["index"] if one["kind"] == "command"]
    assert commands[-1]["by"]["name"] == "alice"
    assert commands[-1]["state"] != "running"
    assert {"ordered", "confirmed"} <= {one["step"] for one in detail["index"] if one["kind"] == "hold"}


async def test_exports_have_every_position(scene: FlightScene) -> None:
    flight = await scene.whole(frames=1200)
    path = f"/api/v1/flights/{flight['id']}/export"
    csv = await scene.holder.get(f"{path}/csv")
    assert (csv.status_code, csv.headers["content-type"]) == (200, "text/csv; charset=utf-8")
    assert len(csv.text.splitlines()) == 1201
    assert "kestrel-20" in csv.headers["content-disposition"]
    for name, element in (("kml", "coord"), ("gpx", "trkpt")):
        answer = await scene.holder.get(f"{path}/{name}")
        root = ElementTree.fromstring(answer.content)
        assert sum(one.tag.endswith(f"}}{element}") for one in root.iter()) == 1200
    assert (await scene.holder.get(f"{path}/exe")).status_code == 422


async def test_the_list_has_filters_and_pages(scene: FlightScene) -> None:
    other = await scene.world.add_drone("harrier", scene.alice)
    async with scene.world.database.writing() as session:
        for number in range(7):
            session.add(
                FlightRow(
                    drone_id=other.id if number % 2 else scene.drone.id,
                    store="elsewhere",
                    file=f"f{number}",
                    state="ready",
                    words="",
                    began_at=scene.world.clock() - timedelta(days=number // 2),
                    ended_at=scene.world.clock(),
                    track=[],
                )
            )
    assert len(await scene.flights()) == 7
    found: list[int] = []
    before: dict[str, str] = {}
    for _ in range(4):
        page = (await scene.holder.get("/api/v1/flights", params={"limit": 2, **before})).json()
        found += [one["id"] for one in page["flights"]]
        before = {"before": page["next"]} if page["next"] else {}
    assert not before
    assert len(found) == len(set(found)) == 7
    assert {one["drone"] for one in await scene.flights(drone_id=other.id)} == {"harrier"}
    assert len(await scene.flights(since=(scene.world.clock() - timedelta(days=1, hours=1)).isoformat())) == 4
    assert len(await scene.flights(until=(scene.world.clock() - timedelta(days=1, hours=1)).isoformat())) == 3
    assert await scene.flights(pilot="alice") == []
    flown = await scene.whole()
    assert [one["id"] for one in await scene.flights(pilot=" ALICE ")] == [flown["id"]]
    assert await scene.flights(pilot="nobody\x00") == []
    for wrong in ("x", "1-", "-1", "9" * 40, "5-99999999999"):
        assert_problem(await scene.holder.get("/api/v1/flights", params={"before": wrong}), 422, "bad-page")
    # bob owns the first drone alone.
    assert {one["drone"] for one in await scene.flights(scene.watcher)} == {"kestrel"}
    assert_problem(await scene.watcher.get("/api/v1/flights", params={"drone_id": other.id}), 404, "unknown-drone")
    elsewhere = next(one["id"] for one in await scene.flights() if one["id"] != flown["id"])
    assert_problem(await scene.holder.get(f"/api/v1/flights/{elsewhere}/tlog"), 409, "flight-elsewhere")


async def test_who_may_not_read_the_drone_finds_no_flight(scene: FlightScene) -> None:
    flight = await scene.whole()
    stranger = await scene.world.signed_in(await scene.world.add_user("eve"))
    observer = await scene.world.signed_in(await scene.world.add_user("olga", Role.OBSERVER))
    anonymous = await scene.world.client()
    for ending in ("", "/tlog", "/export/csv", "/export/kml"):
        for client in (stranger, observer):
            answer = await client.get(f"/api/v1/flights/{flight['id']}{ending}")
            assert_problem(answer, 404, "unknown-flight")
        assert_problem(await anonymous.get(f"/api/v1/flights/{flight['id']}{ending}"), 401, "not-signed-in")
        assert (await scene.admin.get(f"/api/v1/flights/{flight['id']}{ending}")).status_code == 200
    assert await scene.flights(stranger) == []
    assert_problem(await scene.holder.delete(f"/api/v1/flights/{flight['id']}"), 403, "admins-only")


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
    found = await scene.ready(len(await scene.flights()))
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
    from server.store.backup.archive import ArchiveReader
    from server.store.backup.backup import make_backup

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


async def test_a_new_team_has_no_flight_from_before(world_of_two_teams: tuple[TowerWorld, FlightScene]) -> None:
    """Neither in the list nor by its number, and a flight that goes on is cut at the change."""
    world, scene = world_of_two_teams
    old = await scene.whole()
    await scene.arm()
    scene.positions(5)
    await ask(scene.holder, scene.drone.id, "release")
    team = (await scene.admin.post("/api/v1/teams", json={"name": "new"})).json()
    member = await world.add_user("mia")
    path = f"/api/v1/teams/{team['id']}"
    assert (await scene.admin.put(f"{path}/members/{member.id}", json={"role": "operator"})).status_code == 200
    assert (await scene.admin.put(f"{path}/drones/{scene.drone.id}")).status_code == 200
    begun = world.tower.hub.flights.counts
    await until("another flight to begin", lambda: begun["begun"] == 3)
    scene.positions(7)
    await scene.land()
    await scene.ready(3)
    mia = await world.signed_in(member)
    (seen,) = await scene.flights(mia)
    assert seen["frames"] <= 8
    assert_problem(await mia.get(f"/api/v1/flights/{old['id']}"), 404, "unknown-flight")
    assert_problem(await mia.get(f"/api/v1/flights/{old['id']}/tlog"), 404, "unknown-flight")


@pytest.fixture
async def world_of_two_teams(scene: FlightScene) -> tuple[TowerWorld, FlightScene]:
    return scene.world, scene
