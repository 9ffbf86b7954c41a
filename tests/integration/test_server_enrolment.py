"""Enrolment of a drone: a token for one key, its live state, and the pasted command with real processes."""

import base64
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

from onboard_agent.link.identity_file import read_identity
from server.fleet.store.tables import EnrolmentRow
from server.kernel.people import Role
from server.live.hub_events import AgentLinked
from wire.drone_key import DroneKey, enrolment_statement, fingerprint, key_text
from wire.ids import DroneId

ENROL = "/api/v1/enrol"
KEY, ANOTHER = (DroneKey(DroneId(1), seed * 32) for seed in (b"k", b"a"))


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


def asked(token: str, key: DroneKey, signed: str = "") -> dict[str, str]:
    """Returns an agent's request. `signed`: signs this instead of the token."""
    signature = key.sign(enrolment_statement(signed or token, key.public))
    return {
        "token": token,
        "public_key": key_text(key.public),
        "signature": base64.urlsafe_b64encode(signature).decode().rstrip("="),
    }


async def test_a_token_is_worth_one_key_and_admins_see_it_live(
    world: TowerWorld, root: httpx.AsyncClient, hawk: NewDrone
) -> None:
    companion = await world.client()
    operator = await world.signed_in(await world.add_user("Anna"))
    async with live(world, root) as screen, live(world, operator) as theirs:
        begun = await begin(root, hawk, autopilot="serial:/dev/tty AMA0")
        program, words = begun["command"].split(" install ")
        assert program == "$(command -v tower-agent || echo /opt/tower-agent/bin/tower-agent)"
        assert shlex.split(words) == [
            *("--tower", world.base_url, "--enrol", begun["token"]),
            *("--autopilot", "serial:/dev/tty AMA0"),
        ]
        reported = await screen.event("enrolment")
        assert reported["enrolment"]["state"] == "waiting"
        for stolen in (asked(begun["token"], KEY, signed="another"), {**asked(begun["token"], KEY), "public_key": ""}):
            assert_problem(await companion.post(ENROL, json=stolen), 403, "bad-drone-key")
        for _ in range(2):  # the first response was lost
            answer = await companion.post(ENROL, json=asked(begun["token"], KEY))
            assert answer.status_code == 200, answer.text
        tower_key = key_text(world.tower.sign_in_rules.identity.public_key)
        assert answer.json() == {"drone_id": hawk.id, "drone": "hawk", "tower_key": tower_key}
        assert (await screen.event("enrolment"))["enrolment"]["state"] == "used"
        assert_problem(await companion.post(ENROL, json=asked(begun["token"], ANOTHER)), 403, "bad-enrolment")
        record = world.tower.hub.state.drones.get(DroneId(hawk.id)).record
        assert record.public_key == KEY.public != hawk.key.public
        world.tower.event_handler.noticed(AgentLinked(DroneId(hawk.id)))
        while (news := (await screen.event("enrolment"))["enrolment"]["state"]) != "seen":
            assert news == "used"
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
    assert fingerprint(KEY.public) in str(await audit(root, "drone.key_set"))
    # Once the drone's key is removed, the token is useless even to the key's owner.
    await root.delete(f"/api/v1/drones/{hawk.id}/key")
    assert_problem(await companion.post(ENROL, json=asked(begun["token"], KEY)), 403, "bad-enrolment")


async def test_it_expires_and_a_new_one_cancels_what_waits(
    world: TowerWorld, root: httpx.AsyncClient, hawk: NewDrone
) -> None:
    companion = await world.client()
    first = await begin(root, hawk, lasts_s=60)
    second = await begin(root, hawk, lasts_s=60)
    assert await states(root) == ["waiting", "cancelled"]
    assert_problem(await companion.post(ENROL, json=asked(first["token"], KEY)), 403, "bad-enrolment")
    world.clock.advance(61)
    assert await states(root) == ["expired", "cancelled"]
    assert_problem(await companion.post(ENROL, json=asked(second["token"], KEY)), 403, "bad-enrolment")
    root = await world.signed_in("Root")
    third = await begin(root, hawk)
    assert (await root.delete(f"/api/v1/enrolments/{third['enrolment']['id']}")).status_code == 204
    assert_problem(await companion.post(ENROL, json=asked(third["token"], KEY)), 403, "bad-enrolment")
    assert_problem(await companion.post(ENROL, json=asked("twe_made_up", KEY)), 403, "bad-enrolment")
    assert_problem(await root.delete("/api/v1/enrolments/999"), 404, "unknown-enrolment")


async def test_nothing_crosses_a_network_in_the_clear(
    world: TowerWorld, root: httpx.AsyncClient, hawk: NewDrone
) -> None:
    begun = await begin(root, hawk)
    through_a_proxy = await world.client(headers={"X-Forwarded-For": "203.0.113.9", "X-Forwarded-Proto": "http"})
    assert_problem(await through_a_proxy.post(ENROL, json=asked(begun["token"], KEY)), 403, "https-only")
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
        kept = tmp_path / "drone" / "etc" / "tower-agent" / "token"
        world.install_agent("enrolled", begun["command"], tmp_path / "drone")
        world.start(
            "simulator", "tower-sim", "--count", "1", "--home", "47.3977,8.5456,488,0", "--out", f"udp:127.0.0.1:{port}"
        )
        world.wait_until_online(admin, drone_id)
        assert stat.S_IMODE(kept.stat().st_mode) == 0o600
        said = world.log_of("enrolled, installed") + world.log_of("enrolled")
        assert begun["token"] not in said
        key = read_identity(kept).key
        assert key is not None
        assert str(key)[-43:] not in said
        assert sorted(kept.parent.iterdir()) == [kept.with_name("agent.toml"), kept]
        second = tmp_path / "second"
        assert world.paste("again", f"{begun['command']} --root {second}").wait(20) == 2
        assert "no longer valid" in world.log_of("again")
        assert not (second / "etc/tower-agent/token").exists()


@pytest.mark.parametrize("host", ["evil.example", "192.0.2.7:8000", "127.0.0.1.evil.example", "x;reboot"])
async def test_the_command_names_no_tower_that_a_request_made_up(
    world: TowerWorld, root: httpx.AsyncClient, hawk: NewDrone, host: str
) -> None:
    answer = await root.post(f"/api/v1/drones/{hawk.id}/enrolments", json={}, headers={"Host": host})
    assert "TOWER_PUBLIC_URL" in assert_problem(answer, 409, "address-unknown")["detail"]
    assert await states(root) == []


@pytest.mark.parametrize("host", ["[::1", "a b"])
async def test_a_host_that_is_none_is_not_in_the_command(
    world: TowerWorld, root: httpx.AsyncClient, hawk: NewDrone, host: str
) -> None:
    answer = await root.post(f"/api/v1/drones/{hawk.id}/enrolments", json={}, headers={"Host": host})
    assert answer.json()["command"].partition(" install ")[2].startswith(f"--tower {world.base_url} --enrol twe_")


async def test_the_address_of_the_settings_is_the_towers(tmp_path: Path) -> None:
    async with start_tower(tmp_path, public_url="https://tower.example.org") as world:
        root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        hawk = await world.add_drone("hawk")
        answer = await root.post(f"/api/v1/drones/{hawk.id}/enrolments", json={}, headers={"Host": "evil.example"})
        assert " --tower https://tower.example.org --enrol twe_" in answer.json()["command"]
