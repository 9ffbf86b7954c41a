"""API tokens over real sockets: what they permit, what they do not, and how they end."""

import asyncio
import json
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import Live, ObedientAgent, ask, audit, until
from fastapi.routing import APIRoute
from sqlalchemy import select
from tower_world import PASSWORD, Person, TowerWorld, assert_problem, start_tower
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from server.accounts.store import tokens
from server.accounts.store.tables import ApiTokenRow, UserRow
from server.app.routers import ROUTERS
from server.kernel.access import NEEDS, Action
from server.kernel.people import Role
from server.kernel.scopes import Scope
from wire.dialect import build, mavlink
from wire.ids import DroneId
from wire.tagged import tag

TOKENS = "/api/v1/tokens"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def made(client: httpx.AsyncClient, *scopes: str, **more: Any) -> dict[str, Any]:
    answer = await client.post(TOKENS, json={"name": "a program", "scopes": list(scopes), **more})
    assert answer.status_code == 201, answer.text
    return answer.json()


async def with_token(world: TowerWorld, secret: str, **headers: str) -> httpx.AsyncClient:
    return await world.client(headers={"Authorization": f"Bearer {secret}", **headers})


@asynccontextmanager
async def live(world: TowerWorld, secret: str, query: str = "", **headers: str) -> AsyncIterator[Live]:
    sent = {"Authorization": f"Bearer {secret}", **headers}
    async with connect(
        world.live_url + query, additional_headers=sent, subprotocols=["tower.v1"], proxy=None
    ) as socket:  # type: ignore[list-item]
        opened = Live(socket)
        await opened.event("welcome")
        yield opened


async def close_code(socket: Any) -> int:
    async with asyncio.timeout(30):
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                await socket.recv()
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


async def test_a_token_is_told_once_and_kept_as_a_hash(world: TowerWorld, anna: Person) -> None:
    person = await world.signed_in(anna)
    reported = await made(person, "watch", "fly", "watch")
    assert reported["secret"].startswith("twt_")
    assert len(reported["secret"]) == 47
    assert reported["token"]["scopes"] == ["fly", "watch"]
    assert reported["token"]["owner"] == {"id": anna.id, "name": "Anna"}
    listed = await person.get(TOKENS)
    assert listed.json() == [reported["token"]]
    assert reported["secret"] not in listed.text
    async with world.database.reading() as session:
        row = await session.scalar(select(ApiTokenRow))
    assert row is not None
    assert reported["secret"] not in str(vars(row))


async def test_it_opens_what_its_scopes_say(world: TowerWorld, anna: Person) -> None:
    hawk = await world.add_drone("hawk", anna)
    ObedientAgent(world.tower.hub, hawk.id).state()
    person = await world.signed_in(anna)
    watcher = await with_token(world, (await made(person, "watch"))["secret"])
    flyer = await with_token(world, (await made(person, "watch", "fly"))["secret"])
    assert (await watcher.get("/api/v1/me")).json()["name"] == "Anna"
    assert [one["name"] for one in (await watcher.get("/api/v1/drones")).json()] == ["hawk"]
    refused = assert_problem(await ask(watcher, hawk.id, "acquire"), 403, "scope-missing")
    assert "the scope fly" in refused["detail"]
    assert (await ask(flyer, hawk.id, "acquire")).json()["holder"]["name"] == "Anna"
    assert (await person.get(TOKENS)).json()[0]["last_used_at"] is not None


async def test_every_route_says_what_it_needs(world: TowerWorld, root: httpx.AsyncClient) -> None:
    """Only sign-in, sign-out and health are open. Each other route refuses a token without the scope."""
    nothing_but = {scope: await with_token(world, (await made(root, scope))["secret"]) for scope in Scope}
    unguarded = set()
    for route in [route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute)]:
        actions = [one.call.action for one in route.dependant.dependencies if hasattr(one.call, "action")]
        if not actions:
            unguarded.add(route.name)
            continue
        action = Action(actions[0])
        path = re.sub(r"{[^}]+}", "999", route.path.replace("{kind:plan_kind}", "mission"))
        for scope, client in nothing_but.items():
            method = min(route.methods)
            answer = await client.request(method, path)
            missing = bool(NEEDS[action] - {scope})
            if method == "HEAD":  # no body to give a reason
                assert (answer.status_code == 403) is missing, (route.name, scope)
                continue
            slug = answer.json().get("type", "") if answer.status_code == 403 else ""
            assert (slug == "/problems/scope-missing") is missing, (route.name, scope, answer.text)
    signing_in = {"sign_in", "sign_in_with_passkey", "ask_for_passkey", "sign_out"}
    assert unguarded == signing_in | {"health", "ready", "enrol", "put_agent_file", "get_agent_release"}, (
        "an agent shows a token, or the ticket of its link"
    )


@pytest.mark.parametrize("scopes", [["admin"], ["metrics", "watch"], []])
async def test_nobody_gets_more_than_they_have(world: TowerWorld, anna: Person, scopes: list[str]) -> None:
    answer = await (await world.signed_in(anna)).post(TOKENS, json={"name": "more", "scopes": scopes})
    document = assert_problem(answer, 422, "invalid-request")
    assert document["errors"][0]["field"] == "scopes"


async def test_an_admins_token_is_an_operators_once_they_are_one(world: TowerWorld, root: httpx.AsyncClient) -> None:
    other = await world.add_user("Other", Role.ADMIN)
    secret = (await made(await world.signed_in(other), "admin", "watch"))["secret"]
    program = await with_token(world, secret)
    assert (await program.get("/api/v1/users")).status_code == 200
    await root.patch(f"/api/v1/users/{other.id}", json={"role": "operator"})
    assert_problem(await program.get("/api/v1/users"), 403, "admins-only")
    assert (await program.get("/api/v1/drones")).json() == []


async def test_tokens_are_looked_after_in_person(world: TowerWorld, root: httpx.AsyncClient) -> None:
    token = await made(root, *[scope.value for scope in Scope])
    program = await with_token(world, token["secret"])
    assert_problem(await program.get(TOKENS), 403, "in-person-only")
    assert_problem(await program.post(TOKENS, json={"name": "x", "scopes": ["watch"]}), 403, "in-person-only")
    assert_problem(await program.delete(f"{TOKENS}/{token['token']['id']}"), 403, "in-person-only")


async def test_each_sees_and_revokes_their_own_and_admins_all(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient
) -> None:
    ben = await world.signed_in(await world.add_user("Ben"))
    person = await world.signed_in(anna)
    token_id = (await made(person, "watch"))["token"]["id"]
    theirs = assert_problem(await ben.delete(f"{TOKENS}/{token_id}"), 404, "unknown-token")
    nobodys = assert_problem(await ben.delete(f"{TOKENS}/4711"), 404, "unknown-token")
    assert {**theirs, "instance": ""} == {**nobodys, "instance": ""}
    assert (await ben.get(TOKENS)).json() == []
    assert_problem(await ben.get(f"{TOKENS}?everybody=true"), 403, "admins-only")
    assert [one["id"] for one in (await root.get(f"{TOKENS}?everybody=true")).json()] == [token_id]
    assert (await root.delete(f"{TOKENS}/{token_id}")).status_code == 204
    assert (await person.get(TOKENS)).json() == []
    trail = await audit(root, "token.")
    assert [(event["action"], event["actor_name"], event["detail"]["token_id"]) for event in trail] == [
        ("token.revoked", "Root", token_id),
        ("token.created", "Anna", token_id),
    ]


@pytest.mark.parametrize("header", ["Bearer twt_made-up", "bearer", "Bearer twd_1_x"])
async def test_a_bad_token_is_refused_even_beside_a_good_cookie(world: TowerWorld, anna: Person, header: str) -> None:
    person = await world.signed_in(anna)
    answer = await person.get("/api/v1/me", headers={"Authorization": header})
    assert_problem(answer, 401, "bad-token")
    assert answer.headers["www-authenticate"] == "Bearer"


async def test_it_ends_by_its_date(world: TowerWorld, anna: Person) -> None:
    person = await world.signed_in(anna)
    ends = (world.clock() + timedelta(hours=1)).isoformat()
    program = await with_token(world, (await made(person, "watch", expires_at=ends))["secret"])
    async with live(world, program.headers["authorization"].split()[1]) as opened:
        assert (await program.get("/api/v1/me")).status_code == 200
        world.clock.advance(3601)
        assert_problem(await program.get("/api/v1/me"), 401, "bad-token")
        assert await close_code(opened.socket) == 4401
    assert (await person.post("/api/v1/session/proof", json={"password": PASSWORD})).status_code == 200
    for bad in (world.clock() - timedelta(seconds=1), world.clock() + timedelta(days=5000)):
        answer = await person.post(TOKENS, json={"name": "x", "scopes": ["watch"], "expires_at": bad.isoformat()})
        assert assert_problem(answer, 422, "invalid-request")["errors"][0]["field"] == "expires_at"


async def test_with_its_owner_it_ends_for_good(world: TowerWorld, anna: Person, root: httpx.AsyncClient) -> None:
    program = await with_token(world, (await made(await world.signed_in(anna), "watch"))["secret"])
    await root.patch(f"/api/v1/users/{anna.id}", json={"disabled": True})
    assert_problem(await program.get("/api/v1/me"), 401, "bad-token")
    await root.patch(f"/api/v1/users/{anna.id}", json={"disabled": False})
    assert_problem(await program.get("/api/v1/me"), 401, "bad-token")


async def test_revoking_cuts_off_what_flies_and_the_drone_holds(world: TowerWorld, anna: Person) -> None:
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state(armed=True, airborne=True)
    person = await world.signed_in(anna)
    reported = await made(person, "watch", "fly")
    program = await with_token(world, reported["secret"])
    await ask(program, hawk.id, "acquire")
    async with live(world, reported["secret"]) as opened:
        assert (await person.delete(f"{TOKENS}/{reported['token']['id']}")).status_code == 204
        assert agent.holds, "it was held before the answer came"
        assert await close_code(opened.socket) == 4401
    assert (await person.get(f"/api/v1/drones/{hawk.id}")).json()["holder"] is None


async def test_revoking_elsewhere_cuts_off_within_a_moment(world: TowerWorld, anna: Person) -> None:
    """As `tower token revoke` does: another process writes directly to the database."""
    reported = await made(await world.signed_in(anna), "watch")
    async with live(world, reported["secret"]) as opened:
        async with world.database.writing() as session:
            await tokens.revoke_token(session, token_id=reported["token"]["id"], of_user=None, action=world._action())
        assert await close_code(opened.socket) == 4401


async def test_whoever_only_watches_does_not_fly_and_is_nobodys_presence(world: TowerWorld, anna: Person) -> None:
    hawk = await world.add_drone("hawk", anna)
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state()
    secret = (await made(await world.signed_in(anna), "watch", "fly"))["secret"]
    await ask(await with_token(world, secret), hawk.id, "acquire")
    command = mavlink.MAVLink_command_long_message(1, 1, 400, 0, *[0.0] * 7)
    frame = tag(DroneId(hawk.id), build(command, system_id=255, component_id=190, sequence=0))
    drone = world.tower.hub.state.drones.get(DroneId(hawk.id))
    assert drone is not None
    async with live(world, secret, "?scopes=watch") as watching:
        await watching.socket.send(frame)
        assert (await watching.event("notice"))["code"] == "not-in-control"
        assert not drone.somebody_flies()
        async with live(world, secret):
            await until("presence", drone.somebody_flies)
        await until("absence", lambda: not drone.somebody_flies())


@pytest.mark.parametrize(("scopes", "query"), [(["fly"], ""), (["watch", "fly"], "?scopes=fly")])
async def test_without_watching_there_is_no_live_channel(
    world: TowerWorld, anna: Person, scopes: list[str], query: str
) -> None:
    secret = (await made(await world.signed_in(anna), *scopes))["secret"]
    headers = {"Authorization": f"Bearer {secret}"}
    async with connect(world.live_url + query, additional_headers=headers, proxy=None) as socket:
        assert await close_code(socket) == 4403


async def test_origins_matter_for_cookies_only(world: TowerWorld, anna: Person) -> None:
    hawk = await world.add_drone("hawk", anna)
    ObedientAgent(world.tower.hub, hawk.id).state()
    person = await world.signed_in(anna)
    secret = (await made(person, "watch", "fly"))["secret"]
    elsewhere = {"Origin": "https://elsewhere.example"}
    program = await with_token(world, secret, **elsewhere)
    assert (await ask(program, hawk.id, "acquire")).status_code == 200
    async with live(world, secret, **elsewhere):
        pass
    refused = await person.post(TOKENS, json={"name": "x", "scopes": ["watch"]}, headers=elsewhere)
    assert_problem(refused, 403, "wrong-origin")


async def test_there_is_a_bound(world: TowerWorld, anna: Person, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tokens, "MAX_PER_USER", 2)
    person = await world.signed_in(anna)
    for _ in range(2):
        await made(person, "watch")
    answer = await person.post(TOKENS, json={"name": "x", "scopes": ["watch"]})
    assert_problem(answer, 409, "too-many-tokens")


async def test_expired_ones_make_room(
    world: TowerWorld, anna: Person, root: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tokens, "MAX_PER_USER", 2)
    person = await world.signed_in(anna)
    await made(person, "watch")
    await made(person, "watch", expires_at=(world.clock() + timedelta(seconds=60)).isoformat())
    world.clock.advance(61)
    assert len((await person.get(TOKENS)).json()) == 2, "listed for as long as there is room"
    await made(person, "fly")
    assert [one["scopes"] for one in (await person.get(TOKENS)).json()] == [["watch"], ["fly"]]
    assert len(await audit(root, "token.expired")) == 1
    assert_problem(await person.post(TOKENS, json={"name": "x", "scopes": ["watch"]}), 409, "too-many-tokens")


async def test_a_deleted_users_tokens_are_gone(world: TowerWorld, anna: Person, root: httpx.AsyncClient) -> None:
    await made(await world.signed_in(anna), "watch")
    await root.delete(f"/api/v1/users/{anna.id}")
    async with world.database.reading() as session:
        assert await session.scalar(select(ApiTokenRow)) is None
        assert await session.get(UserRow, anna.id) is None


def test_the_table_of_scopes_covers_every_action() -> None:
    assert set(NEEDS) == set(Action)
    assert json.dumps(sorted(Scope)) == '["admin", "fly", "metrics", "watch"]'
