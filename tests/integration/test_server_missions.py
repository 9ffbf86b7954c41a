"""The library of missions: a user's own, shared ones, and no lost changes."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from control_world import audit
from tower_world import TowerWorld, assert_problem, start_tower

from server.kernel.people import Role
from server.plans.store import library

MISSIONS = "/api/v1/missions"
ROW = [16, 3, [0, 0.1, 0, None], 470000000, 80000000, 30.5, 1]
KEPT_ROW = [16, 3, [0.0, 0.10000000149011612, 0.0, None], 470000000, 80000000, 30.5, 1]
DOCUMENT = {
    "mission": [ROW, ROW],
    "fence": [ROW],
    "rally": [],
    "home": {"lat_e7": 470000000, "lon_e7": 80000000, "alt_m": 500.0},
    "defaults": {"height_m": 30, "frame": 3, "speed_m_s": 5},
}


def body(name: str = "field", **more: Any) -> dict[str, Any]:
    return {"name": name, "document": DOCUMENT} | more


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


async def test_a_plan_is_kept_as_it_was_drawn_and_listed_without_it(world: TowerWorld) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    made = await alice.post(MISSIONS, json=body(" north  field "))
    assert made.status_code == 201, made.text
    mission = made.json()
    assert made.headers["ETag"] == '"1"'
    assert mission["counts"] == {"mission": 2, "fence": 1, "rally": 0}
    assert (await alice.get(MISSIONS)).json() == [mission]
    whole = await alice.get(f"{MISSIONS}/{mission['id']}")
    assert whole.headers["ETag"] == '"1"'
    kept = whole.json()
    assert {**kept, "document": None} == {**mission, "document": None}
    assert kept["document"]["mission"] == [KEPT_ROW, KEPT_ROW]
    assert kept["document"]["home"] == DOCUMENT["home"]
    assert kept["document"]["defaults"] == DOCUMENT["defaults"]


async def test_nobody_replaces_what_they_have_not_seen(world: TowerWorld) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    path = f"{MISSIONS}/{(await alice.post(MISSIONS, json=body())).json()['id']}"
    assert_problem(await alice.put(path, json=body()), 428, "version-needed")
    first, second = await asyncio.gather(
        *(alice.put(path, json=body(name), headers={"If-Match": '"1"'}) for name in ("one", "two"))
    )
    assert sorted([first.status_code, second.status_code]) == [200, 412]
    lost = first if first.status_code == 412 else second
    assert_problem(lost, 412, "changed-meanwhile")
    for tag in ('"1"', "*", "2", '"99"'):
        assert (await alice.put(path, json=body(), headers={"If-Match": tag})).status_code == 412
    again = await alice.put(path, json=body("three"), headers={"If-Match": 'W/"2"'})
    assert (again.json()["version"], again.json()["name"], again.headers["ETag"]) == (3, "three", '"3"')


async def test_ones_own_is_ones_own_and_what_is_shared_is_read_by_all(world: TowerWorld) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    bob = await world.signed_in(await world.add_user("bob"))
    root = await world.signed_in(await world.add_user("root", Role.ADMIN))
    private = f"{MISSIONS}/{(await alice.post(MISSIONS, json=body('mine'))).json()['id']}"
    shared = f"{MISSIONS}/{(await alice.post(MISSIONS, json=body('ours', shared=True))).json()['id']}"
    for other in (bob, root):
        for method in ("GET", "PUT", "DELETE"):
            answer = await other.request(method, private, json=body() if method == "PUT" else None)
            assert_problem(answer, 404, "unknown-mission")
        assert [one["name"] for one in (await other.get(MISSIONS)).json()] == ["ours"]
        assert (await other.get(shared)).json()["owner"]["name"] == "alice"
    assert_problem(await bob.put(shared, json=body(), headers={"If-Match": '"1"'}), 403, "not-your-mission")
    assert_problem(await bob.delete(shared), 403, "not-your-mission")
    changed = await root.put(shared, json=body("ours, checked", shared=True), headers={"If-Match": '"1"'})
    assert changed.json()["owner"]["name"] == "alice"
    assert (await alice.delete(private)).status_code == 204
    assert_problem(await alice.get(private), 404, "unknown-mission")
    actions = [(event["action"], event["actor_name"]) for event in await audit(root, "mission.")]
    assert actions == [
        ("mission.deleted", "alice"),
        ("mission.changed", "root"),
        ("mission.created", "alice"),
        ("mission.created", "alice"),
    ]


async def test_there_is_an_end_to_it(world: TowerWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library, "MAX_MISSIONS", 2)
    alice = await world.signed_in(await world.add_user("alice"))
    answers = await asyncio.gather(*(alice.post(MISSIONS, json=body()) for _ in range(4)))
    assert sorted(one.status_code for one in answers) == [201, 201, 409, 409]
    assert_problem(await alice.post(MISSIONS, json=body()), 409, "too-many-missions")


@pytest.mark.parametrize(
    ("change", "field", "item"),
    [
        ({"document": {**DOCUMENT, "fence": [ROW, ROW[:6]]}}, "document.fence.1", 1),
        ({"document": {**DOCUMENT, "rally": [ROW] * 725}}, "document.rally", None),
        ({"document": {**DOCUMENT, "mission": [[*ROW[:5], 1e39, 1]]}}, "document.mission.0", 0),
        ({"document": {**DOCUMENT, "home": {"lat_e7": 1}}}, "document.home", None),
        ({"document": {"mission": []}}, "document", None),
        ({"document": {**DOCUMENT, "camera": {}}}, "document", None),
        ({"name": " "}, "name", None),
        ({"name": "a" * 65}, "name", None),
    ],
)
async def test_what_is_no_plan_is_not_kept(
    world: TowerWorld, change: dict[str, Any], field: str, item: int | None
) -> None:
    alice = await world.signed_in(await world.add_user("alice"))
    problem = assert_problem(await alice.post(MISSIONS, json=body() | change), 422, "invalid-request")
    assert (problem["errors"][0]["field"], problem.get("item")) == (field, item)
    assert (await alice.get(MISSIONS)).json() == []


async def test_missions_go_with_their_owner(world: TowerWorld) -> None:
    person = await world.add_user("alice")
    alice = await world.signed_in(person)
    await alice.post(MISSIONS, json=body(shared=True))
    root = await world.signed_in(await world.add_user("root", Role.ADMIN))
    assert (await root.delete(f"/api/v1/users/{person.id}")).status_code == 204
    assert (await root.get(MISSIONS)).json() == []
