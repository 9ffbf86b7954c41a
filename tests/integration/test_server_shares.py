"""The shares as an admin sees and changes them."""

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import audit
from tower_world import TowerWorld, assert_problem, start_tower

from server.kernel.people import Role
from server.kernel.shares import SHARES, ShareName

SHARES_PATH = "/api/v1/shares"
ZONE = {"name": "Airport", "kind": "no-fly", "points": [[47, 8], [47, 8.001], [47.001, 8]]}


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def share(admin: httpx.AsyncClient, name: ShareName) -> dict[str, Any]:
    found = {one["name"]: one for one in (await admin.get(SHARES_PATH)).json()}
    assert set(found) == set(SHARES)
    return found[name]


async def test_who_uses_what_is_named(world: TowerWorld, root: httpx.AsyncClient) -> None:
    anna = await world.add_user("Anna")
    operator = await world.signed_in(anna)
    team = (await operator.post("/api/v1/teams", json={"name": "Kites"})).json()
    for name in ("units", "map"):
        await operator.put(f"/api/v1/me/preferences/{name}", json={"a": 1})
    for _ in range(2):
        assert (await operator.post("/api/v1/zones", json=ZONE | {"team_id": team["id"]})).status_code == 201
    requests = {one["name"]: one["used"] for one in (await share(root, ShareName.REQUEST_TIME))["used"]}
    assert requests["Anna"] >= 5
    writes = {one["name"]: one["used"] for one in (await share(root, ShareName.WRITES))["used"]}
    assert writes["Anna"] >= 3
    assert (await share(root, ShareName.ZONES))["used"] == [{"id": team["id"], "name": "Kites", "used": 2}]
    assert (await share(root, ShareName.ZONES_OF_TEAMS))["used"] == [{"id": None, "name": "all together", "used": 2}]


async def test_an_admin_changes_a_limit_and_it_counts_at_once(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        operator = await world.signed_in(await world.add_user("Anna"))
        team = (await operator.post("/api/v1/teams", json={"name": "Kites"})).json()
        changed = await root.put(f"{SHARES_PATH}/zones", json={"limit": 1})
        assert (changed.json()["limit"], changed.json()["changed_by"]) == (1, "Root")
        zone = ZONE | {"team_id": team["id"]}
        assert (await operator.post("/api/v1/zones", json=zone)).status_code == 201
        refused = assert_problem(await operator.post("/api/v1/zones", json=zone), 409, "too-many-zones")
        assert "may have 1 zones" in refused["detail"]
    async with start_tower(tmp_path) as world:  # it outlives a restart
        root = await world.signed_in("Root")
        assert (await share(root, ShareName.ZONES))["limit"] == 1
        back = await root.put(f"{SHARES_PATH}/zones", json={"limit": None})
        assert (back.json()["limit"], back.json()["changed_by"]) == (50, None)
        trail = await audit(root, "share.changed")
        assert [one["detail"] for one in trail] == [
            {"share": "zones", "limit": 50, "before": 1},
            {"share": "zones", "limit": 1, "before": 50},
        ]


async def test_what_is_no_limit(world: TowerWorld, root: httpx.AsyncClient) -> None:
    for name, limit in (("zones", 0), ("zones", 10_000), ("writes", 49)):
        document = assert_problem(
            await root.put(f"{SHARES_PATH}/{name}", json={"limit": limit}), 422, "invalid-request"
        )
        assert document["errors"][0]["field"] == "limit"
    assert_problem(await root.put(f"{SHARES_PATH}/all", json={"limit": 5}), 422, "invalid-request")
    operator = await world.signed_in(await world.add_user("Anna"))
    assert_problem(await operator.get(SHARES_PATH), 403, "admins-only")
    assert_problem(await operator.put(f"{SHARES_PATH}/zones", json={"limit": 250}), 403, "admins-only")


async def test_a_person_who_asks_too_much_is_told_to_wait_and_still_flies(tmp_path: Path) -> None:
    async with start_tower(tmp_path, shares=((ShareName.WRITES, 50),)) as world:
        anna = await world.add_user("Anna")
        operator = await world.signed_in(anna)
        other = await world.signed_in(await world.add_user("Ben"))
        drone = await world.add_drone("Kestrel", anna)
        world.tower.authenticator.requests._monotonic = lambda: 0.0
        path = "/api/v1/me/preferences/x"
        answers = [await operator.put(path, json={"n": number}) for number in range(51)]
        assert_problem(answers[-1], 429, "too-many-requests")
        assert int(answers[-1].headers["Retry-After"]) >= 1
        assert answers[0].status_code == 204
        acquired = await operator.post(f"/api/v1/drones/{drone.id}/control/acquire", json={})
        assert acquired.status_code != 429
        assert (await other.put(path, json={"n": 1})).status_code == 204
