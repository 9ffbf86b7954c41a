"""Drones over a real socket: administration, keys, and the separation of owners."""

import asyncio
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from tower_world import Person, TowerWorld, assert_problem, start_tower

from server.fleet.store.drones import create_drone
from server.kernel.people import Role
from server.storage.database import open_database
from wire.drone_key import fingerprint
from wire.ids import DroneId

DRONES = "/api/v1/drones"


@pytest.fixture
async def world(tmp_path: Path):
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> Person:
    return await world.add_user("Root", Role.ADMIN)


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


def unknown_plan(kind: str) -> dict[str, Any]:
    return {"kind": kind, "state": "unknown", "hash": None, "sent_hash": None, "count": 0, "fit_to_fly": True}


async def test_a_new_drone_has_no_identity_until_an_agent_is_enrolled(world: TowerWorld, root: Person) -> None:
    admin = await world.signed_in(root)
    answer = await admin.post(DRONES, json={"name": "  hawk "})
    assert answer.status_code == 201, answer.text
    assert list(answer.json()) == ["drone"]
    drone = answer.json()["drone"]
    assert drone == {
        "id": drone["id"],
        "name": "hawk",
        "online": False,
        "owners": [],
        "loans": [],
        "holder": None,
        "epoch": 0,
        "taken_from": None,
        "autopilot_heard": False,
        "armed": None,
        "airborne": None,
        "watched_only": False,
        "other_systems": [],
        "hears_agent": None,
        "signing": "off",
        "hold": None,
        "airborne_since": None,
        "last_heard": None,
        "offered": False,
        "assistant": None,
        "may_watch": True,
        "may_watch_video": True,
        "lost_action": "return",
        "lost_action_s": 30.0,
        "agent_version": None,
        "firmware": None,
        "release": None,
        "profile": None,
        "profile_chosen": "auto",
        "profile_why": "",
        "plans": {kind: unknown_plan(kind) for kind in ("mission", "fence", "rally")},
        "identity": {"kind": "none", "fingerprint": None, "since": None},
        "parameters": {"hash": None, "count": 0, "total": 0},
        "suspicious_motion": None,
        "restraint": None,
        "relation": "admin",
        "team": None,
    }
    assert (await admin.get(f"{DRONES}/{drone['id']}")).json() == drone
    assert world.tower.hub.state.drones.get(DroneId(drone["id"])).record.identity == ("", b"")
    trail = await admin.get("/api/v1/audit")
    assert trail.json()[0]["action"] == "drone.created"


async def test_everybody_who_sees_a_drone_sees_by_what_it_is_known_and_an_admin_revokes_it(
    world: TowerWorld, root: Person, anna: Person
) -> None:
    hawk = await world.add_drone("hawk", anna)
    admin, operator = await world.signed_in(root), await world.signed_in(anna)
    seen = (await operator.get(f"{DRONES}/{hawk.id}")).json()["identity"]
    assert (seen["kind"], seen["fingerprint"]) == ("key", fingerprint(hawk.key.public))
    assert datetime.fromisoformat(seen["since"]) <= world.clock()
    assert_problem(await operator.delete(f"{DRONES}/{hawk.id}/key"), 403, "admins-only")
    for _ in range(2):
        answer = await admin.delete(f"{DRONES}/{hawk.id}/key")
        assert answer.json()["identity"] == {"kind": "none", "fingerprint": None, "since": None}
    assert world.tower.hub.state.drones.get(DroneId(hawk.id)).record.identity == ("", b"")
    trail = [one["action"] for one in (await admin.get("/api/v1/audit")).json()]
    assert trail.count("drone.key_revoked") == 1


async def test_names_are_unique_and_can_be_changed(world: TowerWorld, root: Person) -> None:
    hawk, kite = await world.add_drone("hawk"), await world.add_drone("kite")
    admin = await world.signed_in(root)
    assert_problem(await admin.post(DRONES, json={"name": "HAWK"}), 409, "name-taken")
    assert_problem(await admin.patch(f"{DRONES}/{kite.id}", json={"name": "Hawk"}), 409, "name-taken")
    assert (await admin.patch(f"{DRONES}/{hawk.id}", json={"name": "Hawk"})).json()["name"] == "Hawk"
    for bad in ("", "x" * 65, "a\nb"):
        document = assert_problem(await admin.patch(f"{DRONES}/{hawk.id}", json={"name": bad}), 422, "invalid-request")
        assert document["errors"][0]["field"] == "name"


async def test_the_squad_follows_ownership_at_once(world: TowerWorld, root: Person, anna: Person) -> None:
    hawk = await world.add_drone("hawk")
    await world.add_drone("kite")
    admin, operator = await world.signed_in(root), await world.signed_in(anna)
    assert (await operator.get(DRONES)).json() == []
    path = f"{DRONES}/{hawk.id}/owners/{anna.id}"
    for _ in range(2):
        assert (await admin.put(path)).json()["owners"] == [{"id": anna.id, "name": "Anna"}]
    assert [one["name"] for one in (await operator.get(DRONES)).json()] == ["hawk"]
    assert (await operator.get(f"{DRONES}/{hawk.id}")).json()["name"] == "hawk"
    for _ in range(2):
        assert (await admin.delete(path)).json()["owners"] == []
    assert (await operator.get(DRONES)).json() == []
    assert [one["name"] for one in (await admin.get(DRONES)).json()] == ["hawk", "kite"]
    assert_problem(await admin.put(f"{DRONES}/{hawk.id}/owners/999"), 404, "unknown-user")
    assert_problem(await admin.put(f"{DRONES}/999/owners/{anna.id}"), 404, "unknown-drone")


async def test_not_yours_and_not_there_are_the_same_to_the_byte(world: TowerWorld, anna: Person, root: Person) -> None:
    ben = await world.add_user("Ben")
    await world.add_drone("hawk", anna)
    kite = await world.add_drone("kite", ben)
    operator = await world.signed_in(anna)
    nowhere = 4711
    for method, suffix in (("GET", ""), ("POST", "/control/acquire"), ("POST", "/control/release")):
        theirs = await operator.request(method, f"{DRONES}/{kite.id}{suffix}")
        missing = await operator.request(method, f"{DRONES}/{nowhere}{suffix}")
        assert_problem(theirs, 404, "unknown-drone")
        assert theirs.content.replace(f"/{kite.id}".encode(), b"") == missing.content.replace(
            f"/{nowhere}".encode(), b""
        )
        ignored = {"content-length", "date", "x-request-id"}  # the id is random
        assert {k: v for k, v in theirs.headers.items() if k not in ignored} == {
            k: v for k, v in missing.headers.items() if k not in ignored
        }


@pytest.mark.parametrize(
    ("method", "suffix", "body"),
    [
        ("POST", "", {"name": "mine"}),
        ("PATCH", "/1", {"name": "mine"}),
        ("DELETE", "/1", None),
        ("DELETE", "/1/key", None),
        ("PUT", "/1/owners/1", None),
        ("DELETE", "/1/owners/1", None),
    ],
)
async def test_administration_is_for_admins(
    world: TowerWorld, root: Person, anna: Person, method: str, suffix: str, body: dict | None
) -> None:
    hawk = await world.add_drone("hawk", anna)
    assert hawk.id == 1
    operator, stranger = await world.signed_in(anna), await world.client()
    assert_problem(await operator.request(method, DRONES + suffix, json=body), 403, "admins-only")
    assert_problem(await stranger.request(method, DRONES + suffix, json=body), 401, "not-signed-in")
    admin = await world.signed_in(root)
    assert [(one["name"], len(one["owners"])) for one in (await admin.get(DRONES)).json()] == [("hawk", 1)]


async def test_the_id_of_a_deleted_drone_never_comes_back(world: TowerWorld, root: Person) -> None:
    hawk = await world.add_drone("hawk")
    admin = await world.signed_in(root)
    assert (await admin.delete(f"{DRONES}/{hawk.id}")).status_code == 204
    assert_problem(await admin.get(f"{DRONES}/{hawk.id}"), 404, "unknown-drone")
    assert_problem(await admin.delete(f"{DRONES}/{hawk.id}"), 404, "unknown-drone")
    assert (await world.add_drone("hawk")).id > hawk.id


async def test_a_drone_added_by_another_process_is_noticed(world: TowerWorld, root: Person) -> None:
    """The roster's own poll notices it, without a call of refresh."""
    admin = await world.signed_in(root)
    other_process = open_database(world.settings.database_url)
    async with other_process.writing() as session:
        await create_drone(session, name="kite", action=world._action())
    await other_process.close()
    async with asyncio.timeout(30):
        while [one["name"] for one in (await admin.get(DRONES)).json()] != ["kite"]:  # noqa: ASYNC110 - another process
            await asyncio.sleep(0.05)
