"""Credentials change only in person and with a fresh proof, and no credential outlives its owner's removal of it."""

import asyncio
from collections.abc import AsyncIterator
from datetime import datetime, timedelta
from pathlib import Path

import httpx
import pyotp
import pytest
from control_world import ObedientAgent, ask, audit, live, until
from sqlalchemy import update
from tower_world import PASSWORD, Person, TowerWorld, assert_problem, start_tower
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from server.accounts.store.tables import ApiTokenRow, UserRow
from server.kernel.people import Role
from server.kernel.scopes import ALL_SCOPES

PROOF = "/api/v1/session/proof"
TOKENS = "/api/v1/tokens"
NEW_PASSWORD = "four words are longer"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


@pytest.fixture
async def admin(world: TowerWorld) -> Person:
    return await world.add_user("Root", Role.ADMIN)


async def token_of(client: httpx.AsyncClient, *scopes: str) -> dict[str, str]:
    """Returns the header for a new token."""
    answer = await client.post(TOKENS, json={"name": "program", "scopes": list(scopes)})
    assert answer.status_code == 201, answer.text
    return {"Authorization": f"Bearer {answer.json()['secret']}"}


async def close_code(socket: ClientConnection) -> int:
    """Returns the code with which the tower closes the connection. Discards earlier messages."""
    with pytest.raises(ConnectionClosed) as closed:
        async with asyncio.timeout(20):
            while True:
                await socket.recv()
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


async def second_factor_on(world: TowerWorld, client: httpx.AsyncClient) -> pyotp.TOTP:
    begun = await client.post("/api/v1/me/second-factor")
    telephone = pyotp.TOTP(begun.json()["secret"])
    confirmed = await client.post("/api/v1/me/second-factor/confirm", json={"code": telephone.at(world.clock())})
    assert confirmed.status_code == 200, confirmed.text
    return telephone


async def test_a_token_of_an_admin_takes_over_nothing(world: TowerWorld, anna: Person, admin: Person) -> None:
    """Before the fix, a token with the scope admin alone could remove its owner's second factor and set their
    password. Later it could still enrol an agent of its own for anybody's drone."""
    root = await world.signed_in(admin)
    hawk = await world.add_drone("Hawk", anna)
    await second_factor_on(world, root)
    program = await world.client(headers=await token_of(root, *[scope.value for scope in ALL_SCOPES]))
    users = "/api/v1/users"
    asked = [
        await program.delete(f"{users}/{admin.id}/second-factor"),
        await program.patch(f"{users}/{admin.id}", json={"password": NEW_PASSWORD}),
        await program.delete(f"{users}/{anna.id}/second-factor"),
        await program.patch(f"{users}/{anna.id}", json={"password": NEW_PASSWORD}),
        await program.patch(f"{users}/{anna.id}", json={"role": "admin"}),
        await program.post(users, json={"name": "Eve", "password": NEW_PASSWORD, "role": "admin"}),
        await program.delete(f"{users}/{anna.id}"),
        await program.post(TOKENS, json={"name": "more", "scopes": ["fly"]}),
        await program.post(PROOF, json={"password": PASSWORD}),
        await program.post("/api/v1/me/second-factor/remove"),
        await program.post(f"/api/v1/drones/{hawk.id}/enrolments", json={}),
        await program.delete(f"/api/v1/drones/{hawk.id}/key"),
        await program.delete("/api/v1/enrolments/1"),
    ]
    for answer in asked:
        assert_problem(answer, 403, "in-person-only")
    assert (await program.get(users)).status_code == 200, "what it is for goes on"
    assert (await root.get("/api/v1/me")).json()["second_factor"] is True
    await world.signed_in(anna)


async def test_a_stolen_cookie_changes_no_credentials(world: TowerWorld, anna: Person, admin: Person) -> None:
    root = await world.signed_in(admin)
    hawk = await world.add_drone("Hawk", anna)
    world.clock.advance(300)
    users, change = "/api/v1/users", {"old_password": PASSWORD, "new_password": NEW_PASSWORD}
    sessions = (await root.get("/api/v1/sessions")).json()
    asked = [
        await root.post("/api/v1/me/password", json=change),
        await root.post("/api/v1/me/second-factor"),
        await root.post("/api/v1/me/second-factor/confirm", json={"code": "123456"}),
        await root.post("/api/v1/me/second-factor/recovery-codes"),
        await root.post("/api/v1/me/second-factor/remove"),
        await root.post(TOKENS, json={"name": "more", "scopes": ["fly"]}),
        await root.delete(f"{TOKENS}/1"),
        await root.delete(f"/api/v1/sessions/{sessions[0]['id']}"),
        await root.delete(f"{users}/{admin.id}/second-factor"),
        await root.patch(f"{users}/{admin.id}", json={"password": NEW_PASSWORD}),
        await root.patch(f"{users}/{anna.id}", json={"password": NEW_PASSWORD}),
        await root.post(users, json={"name": "Eve", "password": NEW_PASSWORD}),
        await root.delete(f"{users}/{anna.id}"),
        await root.post(f"/api/v1/drones/{hawk.id}/enrolments", json={}),
        await root.delete(f"/api/v1/drones/{hawk.id}/key"),
        await root.delete("/api/v1/enrolments/1"),
    ]
    for answer in asked:
        assert_problem(answer, 403, "proof-needed")
    proof = (await root.get(PROOF)).json()
    assert (proof["fresh"], proof["kinds"], proof["code_needed"]) == (False, ["password"], False)

    assert_problem(await root.post(PROOF, json={"password": "not mine"}), 403, "wrong-password")
    assert (await root.post(PROOF, json={"password": PASSWORD})).json()["fresh"] is True
    assert (await root.post(TOKENS, json={"name": "more", "scopes": ["fly"]})).status_code == 201
    (proved,) = await audit(root, "session.proved")
    assert proved["detail"]["kind"] == "password"


async def test_the_proof_is_throttled_as_signing_in_is(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    world.clock.stop()
    slugs = [(await client.post(PROOF, json={"password": "wrong"})).json()["type"] for _ in range(7)]
    assert slugs == ["/problems/wrong-password"] * 5 + ["/problems/too-many-tries"] * 2


async def test_a_new_factor_voids_the_proofs_that_lack_it(world: TowerWorld, anna: Person) -> None:
    here, there = await world.signed_in(anna), await world.signed_in(anna)
    telephone = await second_factor_on(world, here)
    assert_problem(await there.post("/api/v1/me/second-factor/remove"), 403, "proof-needed")
    assert_problem(await there.post(PROOF, json={"password": PASSWORD}), 403, "code-needed")
    world.clock.advance(30)
    body = {"password": PASSWORD, "code": telephone.at(world.clock())}
    assert (await there.post(PROOF, json=body)).status_code == 200
    assert_problem(await there.post(PROOF, json=body), 403, "code-refused")


@pytest.mark.parametrize("way", ["password", "second-factor", "own", "own-keeping"])
async def test_a_reset_ends_sessions_and_tokens_and_what_is_connected(
    world: TowerWorld, anna: Person, admin: Person, way: str
) -> None:
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    client, root = await world.signed_in(anna), await world.signed_in(admin)
    await second_factor_on(world, client)
    headers = await token_of(client, "watch", "fly")
    program = await world.client(headers=headers)
    await ask(program, hawk.id, "acquire")
    keeps = way == "own-keeping"
    options = {"additional_headers": headers, "subprotocols": ["tower.v1"], "proxy": None}
    async with connect(world.live_url, **options) as by_token, live(world, client) as by_session:
        if way == "second-factor":
            answer = await root.delete(f"/api/v1/users/{anna.id}/second-factor")
        elif way == "password":
            answer = await root.patch(f"/api/v1/users/{anna.id}", json={"password": NEW_PASSWORD})
        else:
            change = {"old_password": PASSWORD, "new_password": NEW_PASSWORD, "keep_tokens": keeps}
            answer = await client.post("/api/v1/me/password", json=change)
        assert answer.status_code == 200, answer.text
        assert await close_code(by_session.socket) == 4401
        if not keeps:
            assert await close_code(by_token) == 4401
            await until("the hold", lambda: len(agent.decided_holds) == 1)
    answer = await program.get("/api/v1/me")
    assert answer.status_code == (200 if keeps else 401)


async def test_every_token_ends_and_says_where_it_was_used(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    world.clock.stop()
    headers = await token_of(client, "watch")
    (token,) = (await client.get(TOKENS)).json()
    assert datetime.fromisoformat(token["expires_at"]) == world.clock() + timedelta(days=90)
    assert (token["last_used_at"], token["last_used_address"]) == (None, "")
    too_late = (world.clock() + timedelta(days=365, seconds=1)).isoformat()
    answer = await client.post(TOKENS, json={"name": "x", "scopes": ["watch"], "expires_at": too_late})
    assert_problem(answer, 422, "invalid-request")

    program = await world.client(headers=headers)
    await program.get("/api/v1/me")
    async with world.database.reading() as session:
        assert (await session.get_one(ApiTokenRow, token["id"])).last_used_at is None, "no request waits for a write"
    (token,) = (await client.get(TOKENS)).json()
    assert datetime.fromisoformat(token["last_used_at"]) == world.clock()
    assert token["last_used_address"] == "127.0.0.1"


async def test_a_tower_can_set_a_shorter_life(tmp_path: Path) -> None:
    async with start_tower(tmp_path, token_longest_days=7) as world:
        client = await world.signed_in(await world.add_user("Anna"))
        world.clock.stop()
        await token_of(client, "watch")
        (token,) = (await client.get(TOKENS)).json()
        assert datetime.fromisoformat(token["expires_at"]) == world.clock() + timedelta(days=7)


async def test_admins_without_the_demanded_factor_may_only_set_one_up(tmp_path: Path) -> None:
    async with start_tower(tmp_path, admins_need_second_factor=True) as world:
        root, anna = await world.add_user("Root", Role.ADMIN), await world.add_user("Anna")
        operator = await world.signed_in(anna)
        assert (await operator.get("/api/v1/drones")).status_code == 200
        admin = await world.signed_in(root)
        assert (await admin.get("/api/v1/me")).json()["must_add_second_factor"] is True
        for path in ("drones", "users", "audit"):
            assert_problem(await admin.get(f"/api/v1/{path}"), 403, "second-factor-demanded")
        assert_problem(await admin.post(TOKENS, json={"name": "x", "scopes": ["fly"]}), 403, "second-factor-demanded")
        await second_factor_on(world, admin)
        assert (await admin.get("/api/v1/users")).status_code == 200
        headers = await token_of(admin, "watch")
        program = await world.client(headers=headers)
        assert (await program.get("/api/v1/drones")).status_code == 200
        assert_problem(await admin.post("/api/v1/me/second-factor/remove"), 409, "last-factor")
        async with world.database.writing() as session:
            await session.execute(update(UserRow).values(totp_sealed=None))
        assert_problem(await program.get("/api/v1/drones"), 403, "second-factor-demanded")


async def test_the_right_password_without_the_code_leaves_a_trace(
    world: TowerWorld, anna: Person, admin: Person
) -> None:
    await second_factor_on(world, await world.signed_in(anna))
    answer = await (await world.client()).post("/api/v1/session", json={"name": "Anna", "password": PASSWORD})
    assert_problem(answer, 401, "second-factor-needed")
    (event,) = await audit(await world.signed_in(admin), "session.code_awaited")
    assert (event["actor_name"], event["address"]) == ("Anna", "127.0.0.1")


async def test_a_new_password_is_judged_by_the_tower_alone(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    for password, acceptable in (("password1234", False), ("short", False), (NEW_PASSWORD, True)):
        answer = await client.post("/api/v1/me/password/judgement", json={"password": password})
        assert answer.json()["acceptable"] is acceptable
        assert password not in answer.text
    change = {"old_password": PASSWORD, "new_password": "password1234"}
    refused = assert_problem(await client.post("/api/v1/me/password", json=change), 422, "invalid-request")
    assert "easy to guess" in refused["detail"]
