"""Statistics, log book and maintenance over REST: what they say, who may read them, and what stays when files go."""

import csv
import io
from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ask
from flight_scene import FlightScene
from sqlalchemy import delete, select
from tower_world import assert_problem, start_tower

from server.audit.store.tables import AuditEventRow
from server.flights.core import recorder
from server.flights.store.tables import FlightFiguresRow, FlightShareRow
from server.kernel.people import Role
from wire.dialect import mavlink


@pytest.fixture(autouse=True)
def _land_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "AFTER_S", 0.3)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[FlightScene]:
    async with start_tower(tmp_path) as world:
        scene = FlightScene(world)
        await scene.begin()
        yield scene


async def got(client: httpx.AsyncClient, path: str, **query: Any) -> Any:
    answer = await client.get(f"/api/v1{path}", params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()


async def table(client: httpx.AsyncClient, path: str, **query: Any) -> list[dict[str, str]]:
    answer = await client.get(f"/api/v1{path}", params=query)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"].startswith("text/csv")
    assert "attachment" in answer.headers["content-disposition"]
    return list(csv.DictReader(io.StringIO(answer.text)))


async def fly_and_hand_over(scene: FlightScene) -> dict[str, Any]:
    """Half of the way by alice, the other half by root."""
    await scene.arm()
    scene.agent.frame(mavlink.MAVLink_heartbeat_message(2, 3, mavlink.MAV_MODE_FLAG_SAFETY_ARMED, 5, 4, 3))
    scene.positions(51)
    await scene.holder.post(f"{scene.path}/commands", json={"command": "hold"})
    assert (await ask(scene.admin, scene.drone.id, "take")).status_code == 200
    scene.positions(50)
    await scene.land()
    return (await scene.ready())[0]


async def test_a_flight_has_its_figures_when_it_closes(scene: FlightScene) -> None:
    flight = await fly_and_hand_over(scene)
    figures = await got(scene.holder, f"/flights/{flight['id']}/figures")
    assert figures["distance_m"] == pytest.approx(100 * 11.13, rel=0.01)
    assert (figures["max_height_m"], figures["max_speed_m_s"]) == (20, 1)
    assert (figures["hand_overs"], figures["duration_s"]) == (1, pytest.approx(flight["duration_s"], abs=0.001))
    assert figures["holds"] >= 1
    assert 0 < figures["air_s"] <= figures["duration_s"]
    alice, root = figures["pilots"]
    assert (alice["pilot"]["name"], root["pilot"]["name"]) == ("alice", "root")
    assert alice["distance_m"] + root["distance_m"] == pytest.approx(figures["distance_m"], abs=0.2)
    assert alice["held_s"] + root["held_s"] == pytest.approx(figures["duration_s"], abs=0.01)


async def test_figures_of_an_older_towers_flight_are_computed_when_asked_for(scene: FlightScene) -> None:
    flight = await fly_and_hand_over(scene)
    path = f"/flights/{flight['id']}/figures"
    before = await got(scene.holder, path)
    async with scene.world.database.writing() as session:
        await session.execute(delete(FlightShareRow))
        await session.execute(delete(FlightFiguresRow))
    assert (await got(scene.holder, "/statistics"))["total"]["flights"] == 0
    assert await got(scene.holder, path) == before
    assert (await got(scene.holder, "/statistics"))["total"]["flights"] == 1


async def test_statistics_and_log_book(scene: FlightScene) -> None:
    flight = await fly_and_hand_over(scene)
    view = await got(scene.holder, "/statistics")
    (drone,) = view["drones"]
    assert (drone["drone"], drone["flights"], drone["incidents"]) == ("kestrel", 1, 1)
    assert {one["pilot"]["name"] for one in view["pilots"]} == {"alice", "root"}
    assert (view["months"][0]["flights"], view["is_whole"]) == (1, True)
    (entry,) = (book := await got(scene.holder, "/log-book"))["entries"]
    assert (entry["flight_id"], entry["drone"], entry["with_others"]) == (flight["id"], "kestrel", ["root"])
    assert 0 < book["total"]["distance_m"] < flight["distance_m"]
    assert [one["pilot"] for one in await table(scene.holder, "/statistics/csv", by="pilots")] != []
    (row,) = await table(scene.holder, "/statistics/csv", by="flights")
    assert (row["flight_id"], row["pilots"]) == (str(flight["id"]), "alice; root")
    (row,) = await table(scene.holder, "/log-book/csv")
    assert float(row["distance_m"]) == book["total"]["distance_m"]
    # A period without flights.
    later = (scene.world.clock() + timedelta(days=1)).isoformat()
    for query in ({"since": later}, {"until": "2020-01-01T00:00:00Z"}):
        assert (await got(scene.holder, "/statistics", **query))["total"]["flights"] == 0
        assert (await got(scene.holder, "/log-book", **query))["entries"] == []


async def test_whoever_may_not_read_a_flight_reads_no_figures_of_it(scene: FlightScene) -> None:
    flight = await fly_and_hand_over(scene)
    stranger = await scene.world.signed_in(await scene.world.add_user("mallory"))
    assert_problem(await stranger.get(f"/api/v1/flights/{flight['id']}/figures"), 404, "unknown-flight")
    assert (await got(stranger, "/statistics"))["drones"] == []
    assert (await got(stranger, "/statistics"))["pilots"] == []
    assert_problem(await stranger.get("/api/v1/statistics", params={"drone_id": scene.drone.id}), 404, "unknown-drone")
    assert await table(stranger, "/statistics/csv", by="flights") == []
    observer = await scene.world.signed_in(await scene.world.add_user("olga", Role.OBSERVER))
    assert (await got(observer, "/statistics"))["drones"] == []
    # The own log book has no drone that one may not read any more.
    assert (await got(scene.admin, "/log-book"))["entries"] != []
    answer = await scene.admin.delete(f"/api/v1/drones/{scene.drone.id}/owners/{scene.alice.id}")
    assert answer.status_code == 200, answer.text
    assert (await got(scene.holder, "/log-book"))["entries"] == []


async def test_quality_of_links_by_place_goes_with_its_flights(
    scene: FlightScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "LINK_EVERY_S", 0.0)
    flight = await fly_and_hand_over(scene)
    path = "/statistics/link-quality"
    view = await got(scene.holder, path)
    assert (view["type"], view["flights"], view["cell_m"], view["is_whole"]) == ("FeatureCollection", 1, 100, True)
    assert sum(one["properties"]["reports"] for one in view["features"]) > 0
    west, south = view["features"][0]["geometry"]["coordinates"][0][0]
    track = flight["track"][0]
    assert (south, west) == pytest.approx(track, abs=0.05)
    rows = await table(scene.holder, f"{path}/csv", cell_m=1000)
    assert sum(int(row["reports"]) for row in rows) == sum(one["properties"]["reports"] for one in view["features"])
    later = (scene.world.clock() + timedelta(days=1)).isoformat()
    assert (await got(scene.holder, path, since=later))["features"] == []
    assert (await scene.holder.get(f"/api/v1{path}", params={"cell_m": 1})).status_code == 422
    # Whoever may not read the flight reads no place of it.
    stranger = await scene.world.signed_in(await scene.world.add_user("mallory"))
    assert (await got(stranger, path))["features"] == []
    assert await table(stranger, f"{path}/csv") == []
    assert_problem(await stranger.get(f"/api/v1{path}", params={"drone_id": scene.drone.id}), 404, "unknown-drone")
    observer = await scene.world.signed_in(await scene.world.add_user("olga", Role.OBSERVER))
    assert (await got(observer, path))["features"] == []
    assert (await scene.admin.delete(f"/api/v1/flights/{flight['id']}")).status_code == 204
    assert (await got(scene.holder, path))["features"] == []


async def test_figures_stay_when_the_flight_goes(scene: FlightScene) -> None:
    flight = await fly_and_hand_over(scene)
    assert (await scene.admin.delete(f"/api/v1/flights/{flight['id']}")).status_code == 204
    assert_problem(await scene.holder.get(f"/api/v1/flights/{flight['id']}/figures"), 404, "unknown-flight")
    assert (await got(scene.holder, "/statistics"))["total"]["flights"] == 1
    assert len((await got(scene.holder, "/log-book"))["entries"]) == 1


async def test_maintenance_is_due_after_hours_in_the_air(scene: FlightScene) -> None:
    path = f"/api/v1/drones/{scene.drone.id}/maintenance"
    answer = await scene.holder.post(path, json={"title": "  Propellers ", "interval_h": 10})
    assert answer.status_code == 201, answer.text
    task = answer.json()
    assert (task["title"], task["flown_h"], task["left_h"], task["state"]) == ("Propellers", 0, 10, "good")
    await fly_and_hand_over(scene)
    for hours, state in ((8.0, "good"), (9.5, "soon"), (10.5, "due")):
        async with scene.world.database.writing() as session:
            row = await session.scalar(select(FlightFiguresRow))
            assert row is not None
            row.flown_s = hours * 3600
        (found,) = await got(scene.holder, "/maintenance")
        assert (found["flown_h"], found["state"], found["may_change"]) == (hours, state, True)
    answer = await scene.admin.post(f"/api/v1/maintenance/{task['id']}/done", json={"note": "all four"})
    assert answer.status_code == 200, answer.text
    assert (answer.json()["state"], answer.json()["flown_h"], answer.json()["done_by"]) == ("good", 0, "root")
    answer = await scene.holder.patch(f"/api/v1/maintenance/{task['id']}", json={"interval_h": 25})
    assert (answer.json()["interval_h"], answer.json()["title"]) == (25, "Propellers")
    assert (await scene.holder.delete(f"/api/v1/maintenance/{task['id']}")).status_code == 204
    assert await got(scene.holder, "/maintenance") == []
    async with scene.world.database.reading() as session:
        query = select(AuditEventRow).where(AuditEventRow.action.like("maintenance.%")).order_by(AuditEventRow.id)
        events = list(await session.scalars(query))
    assert [one.action.split(".")[1] for one in events] == ["added", "done", "changed", "removed"]
    assert events[1].detail == {"task": task["id"], "title": "Propellers", "flown_h": 10.5, "note": "all four"}


async def test_who_may_say_what_maintenance_a_drone_needs(scene: FlightScene) -> None:
    path = f"/api/v1/drones/{scene.drone.id}/maintenance"
    since = (scene.world.clock() - timedelta(days=9)).isoformat()
    task = (await scene.holder.post(path, json={"title": "x", "interval_h": 1, "since": since})).json()
    stranger = await scene.world.signed_in(await scene.world.add_user("mallory"))
    assert_problem(await stranger.post(path, json={"title": "y", "interval_h": 1}), 404, "unknown-drone")
    assert_problem(await stranger.post(f"/api/v1/maintenance/{task['id']}/done", json={}), 404, "unknown-task")
    assert await got(stranger, "/maintenance") == []
    boris = await scene.world.add_user("boris")
    borrower = await scene.world.signed_in(boris)
    lent = {"until": (scene.world.clock() + timedelta(hours=1)).isoformat()}
    answer = await scene.admin.put(f"/api/v1/drones/{scene.drone.id}/loans/{boris.id}", json=lent)
    assert answer.status_code in (200, 201, 204), answer.text
    (seen,) = await got(borrower, "/maintenance")
    assert seen["may_change"] is False
    refused = await borrower.post(f"/api/v1/maintenance/{task['id']}/done", json={})
    assert_problem(refused, 403, "not-yours-to-maintain")
    for bad in ({"title": " ", "interval_h": 1}, {"title": "x", "interval_h": 0}, {"title": "x" * 81, "interval_h": 1}):
        assert (await scene.holder.post(path, json=bad)).status_code == 422
