"""User administration over a real socket: who may, what is valid, and its effect on signed-in people."""

from pathlib import Path

import pytest
from tower_world import PASSWORD, Person, TowerWorld, assert_problem, start_tower

from server.kernel.people import Role

USERS = "/api/v1/users"


@pytest.fixture
async def world(tmp_path: Path):
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> Person:
    return await world.add_user("Root", Role.ADMIN)


async def test_an_admin_creates_a_user_who_can_sign_in(world: TowerWorld, root: Person) -> None:
    admin = await world.signed_in(root)
    answer = await admin.post(USERS, json={"name": " Zoë ", "password": PASSWORD})
    assert answer.status_code == 201, answer.text
    made = answer.json()
    assert made["name"] == "Zoë"
    assert made["role"] == "operator"
    assert made["disabled"] is False
    assert made["created_at"].endswith(("Z", "+00:00"))
    assert PASSWORD not in answer.text
    assert made["must_change_password"] is True
    assert (await admin.get(f"{USERS}/{made['id']}")).json() == made
    assert [one["name"] for one in (await admin.get(USERS)).json()] == ["Root", "Zoë"]
    assert (await (await world.signed_in("zoë")).get("/api/v1/me")).json()["id"] == made["id"]


@pytest.mark.parametrize(
    ("method", "path"),
    [("GET", ""), ("POST", ""), ("GET", "/1"), ("PATCH", "/1"), ("DELETE", "/1")],
)
async def test_an_operator_may_not_and_a_stranger_must_sign_in(
    world: TowerWorld, root: Person, method: str, path: str
) -> None:
    operator = await world.signed_in(await world.add_user("Anna"))
    body = {"name": "Eve", "password": PASSWORD, "role": "admin"} if method == "POST" else None
    if method == "PATCH":
        body = {"role": "operator"}
    assert_problem(await operator.request(method, USERS + path, json=body), 403, "admins-only")
    stranger = await world.client()
    assert_problem(await stranger.request(method, USERS + path, json=body), 401, "not-signed-in")
    admin = await world.signed_in(root)
    assert [one["name"] for one in (await admin.get(USERS)).json()] == ["Root", "Anna"]


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"name": "", "password": PASSWORD}, "name"),
        ({"name": "   ", "password": PASSWORD}, "name"),
        ({"name": "x" * 65, "password": PASSWORD}, "name"),
        ({"name": "a\x00b", "password": PASSWORD}, "name"),
        ({"name": "Eve", "password": "short"}, "password"),
        ({"name": "Eve", "password": "x" * 257}, "password"),
        ({"name": "Eve"}, "password"),
        ({"name": "Eve", "password": PASSWORD, "role": "emperor"}, "role"),
        ({"name": 7, "password": PASSWORD}, "name"),
        ({"name": "Eve", "password": PASSWORD, "is_admin": True}, "is_admin"),
    ],
)
async def test_what_is_not_valid_is_named(world: TowerWorld, root: Person, body: dict, field: str) -> None:
    admin = await world.signed_in(root)
    answer = await admin.post(USERS, json=body)
    document = assert_problem(answer, 422, "invalid-request")
    assert [one["field"] for one in document["errors"]] == [field]
    if body.get("password"):
        assert body["password"] not in answer.text


async def test_a_name_is_taken_in_any_case(world: TowerWorld, root: Person) -> None:
    admin = await world.signed_in(root)
    answer = await admin.post(USERS, json={"name": "ROOT", "password": PASSWORD})
    assert_problem(answer, 409, "name-taken")


async def test_a_disabled_user_is_signed_out_at_once(world: TowerWorld, root: Person) -> None:
    anna = await world.add_user("Anna")
    admin, operator = await world.signed_in(root), await world.signed_in(anna)
    assert (await admin.patch(f"{USERS}/{anna.id}", json={"disabled": True})).json()["disabled"] is True
    assert_problem(await operator.get("/api/v1/me"), 401, "session-expired")
    assert (await admin.patch(f"{USERS}/{anna.id}", json={"disabled": False})).status_code == 200
    assert_problem(await operator.get("/api/v1/me"), 401, "session-expired")
    await world.signed_in(anna)


async def test_a_new_password_ends_sessions_and_the_old_one(world: TowerWorld, root: Person) -> None:
    anna = await world.add_user("Anna")
    admin, operator = await world.signed_in(root), await world.signed_in(anna)
    assert (await admin.patch(f"{USERS}/{anna.id}", json={"password": "another one of theirs"})).status_code == 200
    assert_problem(await operator.get("/api/v1/me"), 401, "session-expired")
    fresh = await world.client()
    old = await fresh.post("/api/v1/session", json={"name": "Anna", "password": PASSWORD})
    assert_problem(old, 401, "wrong-sign-in")
    new = await fresh.post("/api/v1/session", json={"name": "Anna", "password": "another one of theirs"})
    assert new.status_code == 200


@pytest.mark.parametrize("change", [{"role": "operator"}, {"disabled": True}, None])
async def test_the_last_admin_stays(world: TowerWorld, root: Person, change: dict | None) -> None:
    admin = await world.signed_in(root)
    other = await world.add_user("Other", Role.ADMIN)
    assert (await admin.patch(f"{USERS}/{other.id}", json={"disabled": True})).status_code == 200
    path = f"{USERS}/{root.id}"
    answer = await (admin.delete(path) if change is None else admin.patch(path, json=change))
    assert_problem(answer, 409, "last-admin")
    assert (await admin.get("/api/v1/me")).json()["role"] == "admin"


async def test_of_two_admins_one_may_go(world: TowerWorld, root: Person) -> None:
    other = await world.add_user("Other", Role.ADMIN)
    admin = await world.signed_in(root)
    assert (await admin.patch(f"{USERS}/{other.id}", json={"role": "operator"})).json()["role"] == "operator"


async def test_a_deleted_user_is_gone_and_the_id_never_comes_back(world: TowerWorld, root: Person) -> None:
    anna = await world.add_user("Anna")
    await world.add_drone("hawk", anna)
    admin, operator = await world.signed_in(root), await world.signed_in(anna)
    assert (await admin.delete(f"{USERS}/{anna.id}")).status_code == 204
    assert_problem(await operator.get("/api/v1/me"), 401, "session-expired")
    assert_problem(await admin.get(f"{USERS}/{anna.id}"), 404, "unknown-user")
    assert_problem(await admin.delete(f"{USERS}/{anna.id}"), 404, "unknown-user")
    assert (await admin.get("/api/v1/drones")).json()[0]["owners"] == []
    assert (await world.add_user("Anna")).id > anna.id
    trail = (await admin.get("/api/v1/audit")).json()
    signed_in = next(one for one in trail if one["action"] == "session.began" and one["actor_name"] == "Anna")
    assert signed_in["actor_id"] is None


async def test_the_trail_is_for_admins_newest_first_and_in_pages(world: TowerWorld, root: Person) -> None:
    anna = await world.add_user("Anna")
    admin = await world.signed_in(root)
    await admin.patch(f"{USERS}/{anna.id}", json={"role": "admin"})
    await admin.patch(f"{USERS}/{anna.id}", json={"password": "another one of theirs"})
    first = (await admin.get("/api/v1/audit", params={"limit": 2})).json()
    assert [one["action"] for one in first] == ["user.password_changed", "user.role_changed"]
    assert first[0]["actor_name"] == "Root"
    assert first[0]["detail"] == {"user_id": anna.id, "user": "Anna"}
    rest = (await admin.get("/api/v1/audit", params={"before": first[-1]["id"]})).json()
    assert [one["action"] for one in rest] == ["session.began", "user.created", "user.created"]
    assert_problem(await admin.get("/api/v1/audit", params={"limit": 0}), 422, "invalid-request")
    stranger = await world.client()
    assert_problem(await stranger.get("/api/v1/audit"), 401, "not-signed-in")
