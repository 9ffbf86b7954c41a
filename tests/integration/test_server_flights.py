"""Recorded flights over REST: what other programs read of them, who may have them, and how they go."""

import json
import os
import subprocess
import sys
from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from control_world import ask, live, until
from flight_scene import FlightScene
from test_server_metrics import SECRET, bearer, figures
from tower_world import TowerWorld, assert_problem, start_tower

from server.flights.core import recorder
from server.flights.store.tables import FlightRow
from server.kernel.people import Role
from wire.dialect import build, mavlink
from wire.tagged import tag

MAVLOGDUMP = Path(sys.executable).with_name("mavlogdump.py")
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
    report = await scene.holder.get(f"/api/v1/flights/{flight['id']}/report")
    assert "attachment" in report.headers["content-disposition"]
    for words in ("root TOOK control of kestrel", "Hold confirmed by the autopilot"):
        assert words in report.text


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
    for ending in ("", "/tlog", "/export/csv", "/export/kml", "/report"):
        for client in (stranger, observer):
            answer = await client.get(f"/api/v1/flights/{flight['id']}{ending}")
            assert_problem(answer, 404, "unknown-flight")
        assert_problem(await anonymous.get(f"/api/v1/flights/{flight['id']}{ending}"), 401, "not-signed-in")
        assert (await scene.admin.get(f"/api/v1/flights/{flight['id']}{ending}")).status_code == 200
    assert await scene.flights(stranger) == []
    assert_problem(await scene.holder.delete(f"/api/v1/flights/{flight['id']}"), 403, "admins-only")


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
