"""No team learns of another, and no former member watches the team's video."""

import json
import os
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from control_world import ObedientAgent, ask, live, until
from fastapi.routing import APIRoute
from sqlalchemy import delete
from team_world import ADMIN, OBSERVER, OPERATOR, Team
from tower_world import TowerWorld, assert_problem, start_tower

from server.app.routers import ROUTERS
from server.fleet.store.tables import OwnershipRow
from server.flights.core.figures import FlightFigures, PilotShare
from server.flights.core.times import microseconds
from server.flights.store.figures import keep_figures
from server.flights.store.tables import FlightFiguresRow
from server.kernel.people import Role
from server.kernel.relations import TeamRole
from server.video.store.tables import RecordingRow
from wire.ids import DroneId


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def red(world: TowerWorld) -> Team:
    return await Team(world, "Rowan").set_up()


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def test_no_team_learns_of_another(world: TowerWorld, red: Team, root: httpx.AsyncClient) -> None:
    """Searches every GET and the live channel, as each role of one team, for the other team's names."""
    blue = await Team(world, "Zinnia").set_up()
    agents = [ObedientAgent(world.tower.hub, team.drone_id) for team in (red, blue)]
    for agent in agents:
        agent.state(armed=True, airborne=True)
    document = {"mission": [], "fence": [], "rally": []}
    plan = {"name": "Zinnia-plan", "document": document, "shared": True}
    assert (await blue.clients[OPERATOR].post("/api/v1/missions", json=plan)).status_code == 201
    same = {"name": "Rowan-plan", "document": document, "shared": True}
    assert (await red.clients[ADMIN].post("/api/v1/missions", json=same)).status_code == 201
    await blue.clients[ADMIN].post(f"{blue.path}/invitations", json={"name": "Zinnia-anonymous", "role": "operator"})
    await _fly_a_drone_of_the_past(world, red, blue)

    for role in TeamRole:
        client = red.clients[role]
        async with live(world, client) as screen:
            await _make_a_stir(blue)
            await _make_a_stir(red)
            await screen.event("control", drone_id=red.drone_id, event="released")
            heard = json.dumps(screen.events)
        assert "Rowan-operator" in heard
        assert "Zinnia" not in heard
        read = ""
        for path in _every_get(red, blue):
            answer = await client.get(path)
            read += answer.text + str(answer.headers)
        assert "Rowan-drone" in read
        assert ("Rowan-plan" in read) is True
        assert "Zinnia" not in read
    # The names searched for exist: the other team reads them.
    for path in (f"/api/v1/drones/{blue.drone_id}", blue.path, "/api/v1/missions"):
        assert "Zinnia" in (await blue.clients[OPERATOR].get(path)).text
        assert "Zinnia" not in (await red.clients[OPERATOR].get(path)).text


async def _fly_a_drone_of_the_past(world: TowerWorld, red: Team, blue: Team) -> None:
    """Adds a drone that belonged to the other team yesterday, with a recording and a flight log from then."""
    both = await world.add_drone("Rowan-used", red.people[ADMIN], blue.people[ADMIN])
    assert (await blue.clients[ADMIN].put(f"{blue.path}/drones/{both.id}")).status_code == 200
    at = world.clock()
    async with world.database.writing() as session:
        session.add(
            RecordingRow(
                drone_id=both.id,
                store="s",
                file="f",
                by_id=blue.people[OPERATOR].id,
                by_name="Zinnia-operator",
                quality="low",
                codec="h264",
                state="failed",
                words="",
                began_at=at,
                ended_at=at,
                flights=[],
                size_bytes=0,
                pictures=0,
            )
        )
        figures = FlightFigures(
            began_us=microseconds(at),
            ended_us=microseconds(at) + 60_000_000,
            air_s=50.0,
            distance_m=900.0,
            max_height_m=40.0,
            max_speed_m_s=9.0,
            battery_start_v=16.8,
            battery_end_v=16.0,
            used_mah=300.0,
            landings=1,
            holds=0,
            hand_overs=0,
            alerts=0,
            critical_alerts=0,
            link_losses=0,
            link_lost_s=0.0,
            rtt_mean_ms=40.0,
            rtt_max_ms=90.0,
            loss_mean=0.0,
            pilots=(PilotShare(blue.people[OPERATOR].id, "Zinnia-operator", 60.0, 50.0, 900.0, 1),),
        )
        await keep_figures(session, flight_id=9, drone_id=both.id, figures=figures)
        # Yesterday's owner is no owner any more when the drone changes teams.
        row = await session.get(OwnershipRow, (both.id, blue.people[ADMIN].id))
        await session.delete(row)
    await world.tower.roster.refresh()
    hers, logs = f"/api/v1/drones/{both.id}/recordings", f"/api/v1/drones/{both.id}/logs"
    _keep_log(world.tower.settings.files / f"drone-{both.id}" / "7-0.bin", at.timestamp())
    assert "Zinnia-operator" in (await blue.clients[OPERATOR].get(hers)).text
    assert "Zinnia-operator" in (await blue.clients[OPERATOR].get("/api/v1/statistics")).text
    assert "Zinnia" in (await blue.clients[OPERATOR].get(f"{logs}/7/file")).text
    assert (await blue.clients[ADMIN].delete(f"{blue.path}/drones/{both.id}")).status_code == 204
    assert (await red.clients[ADMIN].put(f"{red.path}/drones/{both.id}")).status_code == 200
    assert (await red.clients[OPERATOR].get(hers)).json() == []
    assert (await red.clients[OPERATOR].get(logs)).json()["kept"] == []
    assert (await red.clients[OPERATOR].get("/api/v1/statistics")).json()["total"]["flights"] == 0
    assert_problem(await red.clients[OPERATOR].get(f"{logs}/7/file"), 404, "unknown-log")
    owner = await red.clients[ADMIN].get(f"{logs}/7/file")
    assert owner.status_code == 200, "who owned it then knows it"
    assert "Zinnia-operator" in (await red.clients[ADMIN].get("/api/v1/statistics")).text
    async with world.database.writing() as session:  # the owner may know of them, and nobody else reads them
        await session.execute(delete(FlightFiguresRow))


def _keep_log(path: Path, at: float) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"where Zinnia flew")
    os.utime(path, (at, at))


async def _make_a_stir(team: Team) -> None:
    await ask(team.clients[OPERATOR], team.drone_id, "acquire")
    await ask(team.clients[ADMIN], team.drone_id, "take")
    await ask(team.clients[ADMIN], team.drone_id, "release")
    await team.clients[ADMIN].patch(team.path, json={"name": f"{team.word}-team"})


def _every_get(red: Team, blue: Team) -> list[str]:
    """Returns the path of each GET, filled in with the ids of both teams."""
    paths = set()
    for router in ROUTERS:
        for route in router.routes:
            if not isinstance(route, APIRoute) or "GET" not in route.methods:
                continue
            for team in (red, blue):
                for number in (1, 2, 3):
                    path = route.path.replace("{drone_id}", str(team.drone_id)).replace("{team_id}", str(team.id))
                    path = path.replace("{kind:plan_kind}", "mission").replace("{name}", "units")
                    path = path.replace("{format_name}", "csv").replace("{kind}", "unknown")
                    path = path.replace("{zoom}/{x}/{y}", "1/0/0").replace("{layer_id}", "1")
                    path = path.replace("{version}", "1.0").replace("{import_id}", "0" * 16)
                    for name in ("operation_id", "mission_id", "log_id", "recording_id", "user_id", "flight_id"):
                        path = path.replace(f"{{{name}}}", str(number))
                    paths.add(path)
    assert not [path for path in paths if "{" in path]
    return sorted(paths)


async def test_a_removed_members_video_is_over(world: TowerWorld, red: Team) -> None:
    """The same check as for frames, repeated at each change."""
    viewer = red.clients[OBSERVER]
    hub = world.tower.hub
    member = f"{red.path}/members/{red.people[OBSERVER].id}"
    assert (await viewer.get(f"/api/v1/drones/{red.drone_id}/video")).status_code == 200
    async with live(world, viewer) as screen:
        await red.clients[ADMIN].delete(member)
        await screen.event("drone_removed", drone_id=red.drone_id)
        drone = hub.state.drones.get(DroneId(red.drone_id))
        assert drone is not None
        await until("nobody to watch", lambda: not drone.watchers)
    assert_problem(await viewer.get(f"/api/v1/drones/{red.drone_id}/video"), 404, "unknown-drone")
