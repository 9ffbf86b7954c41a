"""Enrolment of a drone: a token worth one credential, its state live, the pasted command on real processes."""

import shlex
import stat
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from control_world import audit, live
from sqlalchemy import select
from tower_world import NewDrone, TowerWorld, assert_problem, start_tower
from worlds.processes import PASSWORD, World, free_udp_ports

from server.accounts.tables import Role
from server.fleet.tables import EnrolmentRow
from server.relay.hub_events import AgentLinked
from wire.ids import DroneId

ENROL = "/api/v1/enrol"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


@pytest.fixture
async def hawk(world: TowerWorld) -> NewDrone:
    return await world.add_drone("hawk")


async def begin(root: httpx.AsyncClient, drone: NewDrone, **body: object) -> dict:
    answer = await root.post(f"/api/v1/drones/{drone.id}/enrolments", json=body)
    assert answer.status_code == 201, answer.text
    return answer.json()


async def states(root: httpx.AsyncClient) -> list[str]:
    return [one["state"] for one in (await root.get("/api/v1/enrolments")).json()]


async def test_a_token_is_worth_one_credential_and_admins_see_it_live(
    world: TowerWorld, root: httpx.AsyncClient, hawk: NewDrone
) -> None:
    companion = await world.client()
    operator = await world.signed_in(await world.add_user("Anna"))
    async with live(world, root) as screen, live(world, operator) as theirs:
        begun = await begin(root, hawk, autopilot="serial:/dev/tty AMA0")
        assert begun["command"] == shlex.join(
            ["tower-agent", "enrol", world.base_url, begun["token"], "--autopilot", "serial:/dev/tty AMA0"]
        )
        told = await screen.event("enrolment")
        assert told["enrolment"]["state"] == "waiting"
        answer = await companion.post(ENROL, json={"token": begun["token"]})
        assert answer.status_code == 200, answer.text
        assert answer.json()["drone_id"] == hawk.id
        credential = answer.json()["credential"]
        assert credential != hawk.credential
        assert (await screen.event("enrolment"))["enrolment"]["state"] == "used"
        assert_problem(await companion.post(ENROL, json={"token": begun["token"]}), 403, "bad-enrolment")
        world.tower.watchman.noticed(AgentLinked(DroneId(hawk.id)))
        assert (await screen.event("enrolment"))["enrolment"]["state"] == "seen"
        assert "enrolment" not in [event["type"] for event in theirs.events]
    assert await states(root) == ["seen"]
    async with world.database.reading() as session:
        row = await session.scalar(select(EnrolmentRow))
    assert row is not None
    assert begun["token"] not in str(vars(row))
    trail = str(await audit(root, "enrolment."))
    assert "enrolment.began" in trail
    assert "enrolment.used" in trail
    assert begun["token"] not in trail
    assert credential not in trail


async def test_it_expires_and_a_new_one_cancels_what_waits(
    world: TowerWorld, root: httpx.AsyncClient, hawk: NewDrone
) -> None:
    companion = await world.client()
    first = await begin(root, hawk, lasts_s=60)
    second = await begin(root, hawk, lasts_s=60)
    assert await states(root) == ["waiting", "cancelled"]
    assert_problem(await companion.post(ENROL, json={"token": first["token"]}), 403, "bad-enrolment")
    world.clock.advance(61)
    assert await states(root) == ["expired", "cancelled"]
    assert_problem(await companion.post(ENROL, json={"token": second["token"]}), 403, "bad-enrolment")
    root = await world.signed_in("Root")
    third = await begin(root, hawk)
    assert (await root.delete(f"/api/v1/enrolments/{third['enrolment']['id']}")).status_code == 204
    assert_problem(await companion.post(ENROL, json={"token": third["token"]}), 403, "bad-enrolment")
    assert_problem(await companion.post(ENROL, json={"token": "twe_made_up"}), 403, "bad-enrolment")
    assert_problem(await root.delete("/api/v1/enrolments/999"), 404, "unknown-enrolment")


async def test_a_credential_does_not_cross_a_network_in_the_clear(
    world: TowerWorld, root: httpx.AsyncClient, hawk: NewDrone
) -> None:
    begun = await begin(root, hawk)
    through_a_proxy = await world.client(headers={"X-Forwarded-For": "203.0.113.9", "X-Forwarded-Proto": "http"})
    assert_problem(await through_a_proxy.post(ENROL, json={"token": begun["token"]}), 403, "https-only")
    assert await states(root) == ["waiting"]


def test_the_pasted_command_puts_a_simulated_drone_on_the_map(tmp_path: Path) -> None:
    with World(tmp_path) as world:
        world.add_user("admin", "admin")
        drone_id = world.add_drone("Kestrel")
        world.start_tower()
        admin = world.visitor("admin")
        port = free_udp_ports(1)[0]
        with httpx.Client(base_url=world.address, trust_env=False, timeout=20) as client:
            client.post("/api/v1/session", json={"name": "admin", "password": PASSWORD})
            wanted = {"autopilot": f"udpin:127.0.0.1:{port}"}
            begun = client.post(f"/api/v1/drones/{drone_id}/enrolments", json=wanted).json()
        kept = tmp_path / "drone" / "token"
        world.start("enrolled", *shlex.split(begun["command"]), "--token", str(kept))
        world.start(
            "simulator", "tower-sim", "--count", "1", "--home", "47.3977,8.5456,488,0", "--out", f"udp:127.0.0.1:{port}"
        )
        world.wait_until_online(admin, drone_id)
        assert stat.S_IMODE(kept.stat().st_mode) == 0o600
        assert begun["token"] not in world.log_of("enrolled")
        assert kept.read_text().strip() not in world.log_of("enrolled")
        again = world.start("again", *shlex.split(begun["command"]), "--token", str(tmp_path / "second"))
        assert again.wait(20) == 2
        assert "not (any more) good" in world.log_of("again")
        assert not (tmp_path / "second").exists()
