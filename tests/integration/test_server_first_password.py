"""The first password must be changed. Until then nothing else works, over REST and live, in person and with a token."""

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from control_world import ask, audit, live
from tower_world import PASSWORD, TowerWorld, assert_problem, start_tower
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from server.accounts.store.users import UserChange, change_user
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.kernel.people import Role

OWN = "a password of my own"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def change(client: httpx.AsyncClient, old: str = PASSWORD, new: str = OWN) -> httpx.Response:
    return await client.post("/api/v1/me/password", json={"old_password": old, "new_password": new})


async def live_close(world: TowerWorld, client: httpx.AsyncClient) -> int:
    headers = world.cookie_header(client) | {"Origin": world.base_url}
    async with connect(world.live_url, additional_headers=headers, subprotocols=["tower.v1"], proxy=None) as socket:  # type: ignore[list-item]
        with pytest.raises(ConnectionClosed) as closed:
            await socket.recv()
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


async def test_until_it_is_changed_nothing_else_works(world: TowerWorld, root: httpx.AsyncClient) -> None:
    made = (await root.post("/api/v1/users", json={"name": "Zoe", "password": PASSWORD})).json()
    zoe = await world.signed_in("Zoe")
    assert (await zoe.get("/api/v1/me")).json()["must_change_password"] is True
    for path in ("/api/v1/drones", "/api/v1/tokens", "/api/v1/sessions", "/api/v1/me/second-factor"):
        assert_problem(await zoe.get(path), 403, "password-change-needed")
    assert_problem(await zoe.post("/api/v1/me/second-factor"), 403, "password-change-needed")
    assert await live_close(world, zoe) == 4403
    before = zoe.cookies["tower_session"]
    answer = await change(zoe)
    assert answer.status_code == 200, answer.text
    assert answer.json()["must_change_password"] is False
    assert zoe.cookies["tower_session"] != before
    assert (await zoe.get("/api/v1/drones")).json() == []
    async with live(world, zoe):
        pass
    stale = await world.client(cookies={"tower_session": before})
    assert_problem(await stale.get("/api/v1/me"), 401, "session-expired")
    assert [one["action"] for one in await audit(root, "user.password")] == ["user.password_changed"]
    assert (await root.get(f"/api/v1/users/{made['id']}")).json()["must_change_password"] is False


async def test_signing_out_works_before_too(world: TowerWorld, root: httpx.AsyncClient) -> None:
    await root.post("/api/v1/users", json={"name": "Zoe", "password": PASSWORD})
    zoe = await world.signed_in("Zoe")
    assert (await zoe.delete("/api/v1/session")).status_code == 204
    assert_problem(await zoe.get("/api/v1/me"), 401, "not-signed-in")


async def test_an_admins_reset_asks_for_a_change_and_stops_tokens_and_flying(
    world: TowerWorld, root: httpx.AsyncClient
) -> None:
    anna = await world.add_user("Anna")
    hawk = await world.add_drone("hawk", anna)
    person = await world.signed_in(anna)
    token = (await person.post("/api/v1/tokens", json={"name": "x", "scopes": ["watch"]})).json()["secret"]
    program = await world.client(headers={"Authorization": f"Bearer {token}"})
    await ask(person, hawk.id, "acquire")
    async with live(world, person) as screen:
        answer = await root.patch(f"/api/v1/users/{anna.id}", json={"password": "another one of them"})
        assert answer.json()["must_change_password"] is True
        with pytest.raises(ConnectionClosed):
            while True:
                await screen.socket.recv()
    assert (await root.get(f"/api/v1/drones/{hawk.id}")).json()["holder"] is None
    assert_problem(await program.get("/api/v1/drones"), 401, "bad-token")
    fresh = await world.client()
    await fresh.post("/api/v1/session", json={"name": "Anna", "password": "another one of them"})
    assert_problem(await change(fresh, old=PASSWORD), 403, "wrong-password")
    assert_problem(await change(fresh, old="another one of them", new="another one of them"), 422, "invalid-request")
    assert_problem(await change(fresh, old="another one of them", new="short"), 422, "invalid-request")
    assert (await change(fresh, old="another one of them")).status_code == 200
    assert_problem(await program.get("/api/v1/drones"), 401, "bad-token")


async def test_a_reset_on_the_command_line_closes_live_connections_too(world: TowerWorld) -> None:
    anna = await world.add_user("Anna")
    person = await world.signed_in(anna)
    async with live(world, person) as screen:
        hashed = await world.tower.passwords.hash("from the command line")
        async with world.database.writing() as session:
            action = AuditAction(by=COMMAND_LINE, at=world.clock())
            await change_user(session, user_id=anna.id, change=UserChange(password_hash=hashed), action=action)
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                await screen.socket.recv()
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4401


async def test_guessing_the_old_password_of_an_open_session_is_throttled(world: TowerWorld) -> None:
    anna = await world.signed_in(await world.add_user("Anna"))
    world.clock.stop()
    answers = [await change(anna, old=f"wrong guess {number}") for number in range(6)]
    assert [one.status_code for one in answers] == [403] * 5 + [429]
    assert_problem(await change(anna), 429, "too-many-tries")


async def test_one_ends_a_session_of_ones_own_and_an_admin_anybodys(world: TowerWorld, root: httpx.AsyncClient) -> None:
    anna, ben = await world.add_user("Anna"), await world.add_user("Ben")
    first, second, other = [await world.signed_in(one) for one in (anna, anna, ben)]
    listed = (await first.get("/api/v1/sessions")).json()
    assert [(one["user"]["name"], one["current"], one["live"]) for one in listed] == [
        ("Anna", False, 0),
        ("Anna", True, 0),
    ]
    assert_problem(await first.get("/api/v1/sessions?everybody=true"), 403, "admins-only")
    assert len((await root.get("/api/v1/sessions?everybody=true")).json()) == 4
    theirs = listed[0]["id"]
    assert_problem(await other.delete(f"/api/v1/sessions/{theirs}"), 404, "unknown-session")
    async with live(world, second) as screen:
        assert (await first.get("/api/v1/sessions")).json()[0]["live"] == 1
        assert (await first.delete(f"/api/v1/sessions/{theirs}")).status_code == 204
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                await screen.socket.recv()
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4401
    assert_problem(await second.get("/api/v1/me"), 401, "session-expired")
    assert (await root.delete(f"/api/v1/sessions/{listed[1]['id']}")).status_code == 204
    assert_problem(await first.get("/api/v1/me"), 401, "session-expired")
    assert_problem(await root.delete(f"/api/v1/sessions/{theirs}"), 404, "unknown-session")
