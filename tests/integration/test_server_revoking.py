"""Whoever loses the right to a drone loses its controls: the epoch grows, so what they sent before is stale."""

from pathlib import Path

import pytest
from tower_world import Person, TowerWorld, assert_problem, start_tower

from server.accounts.tables import Role


@pytest.fixture
async def world(tmp_path: Path):
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


@pytest.mark.parametrize("way", ["disabled", "deleted", "unassigned"])
async def test_the_controls_are_revoked(world: TowerWorld, anna: Person, way: str) -> None:
    hawk = await world.add_drone("hawk", anna)
    admin = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    operator = await world.signed_in(anna)
    held = (await operator.post(f"/api/v1/drones/{hawk.id}/control/acquire")).json()
    assert held["holder"] == {"id": anna.id, "name": "Anna"}

    if way == "disabled":
        answer = await admin.patch(f"/api/v1/users/{anna.id}", json={"disabled": True})
    elif way == "deleted":
        answer = await admin.delete(f"/api/v1/users/{anna.id}")
    else:
        answer = await admin.delete(f"/api/v1/drones/{hawk.id}/owners/{anna.id}")
    assert answer.is_success, answer.text

    after = (await admin.get(f"/api/v1/drones/{hawk.id}")).json()
    assert after["holder"] is None
    assert after["epoch"] == held["epoch"] + 1
    again = await operator.post(f"/api/v1/drones/{hawk.id}/control/acquire")
    if way == "unassigned":
        assert_problem(again, 404, "unknown-drone")
    else:
        assert_problem(again, 401, "session-expired")
    told = [one["action"] for one in (await admin.get("/api/v1/audit")).json()]
    assert "control.revoke" in told


async def test_a_demoted_admin_does_not_keep_what_is_not_theirs(world: TowerWorld, anna: Person) -> None:
    hawk = await world.add_drone("hawk", anna)
    second = await world.add_user("Second", Role.ADMIN)
    admin, other = await world.signed_in(await world.add_user("Root", Role.ADMIN)), await world.signed_in(second)
    held = (await other.post(f"/api/v1/drones/{hawk.id}/control/take")).json()
    assert held["holder"]["id"] == second.id
    await admin.patch(f"/api/v1/users/{second.id}", json={"role": "operator"})
    after = (await admin.get(f"/api/v1/drones/{hawk.id}")).json()
    assert (after["holder"], after["epoch"]) == (None, held["epoch"] + 1)
    assert_problem(await other.get(f"/api/v1/drones/{hawk.id}"), 404, "unknown-drone")


async def test_an_admin_who_is_no_longer_an_owner_keeps_the_controls(world: TowerWorld) -> None:
    root = await world.add_user("Root", Role.ADMIN)
    hawk = await world.add_drone("hawk", root)
    admin = await world.signed_in(root)
    held = (await admin.post(f"/api/v1/drones/{hawk.id}/control/acquire")).json()
    after = (await admin.delete(f"/api/v1/drones/{hawk.id}/owners/{root.id}")).json()
    assert after["holder"] == held["holder"]
