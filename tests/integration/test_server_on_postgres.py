"""Every feature of accounts and fleet once, on PostgreSQL, which is stricter than SQLite."""

import asyncio
from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pyotp
import pytest
from control_world import ObedientAgent, ask, audit, until
from test_server_enrolment import asked
from tower_world import PASSWORD, Person, TowerWorld, assert_problem, start_tower

from server.kernel.people import Role
from server.storage.schema import newest_revision
from wire.drone_key import DroneKey
from wire.ids import DroneId

API = "/api/v1"


@pytest.fixture
async def world(tmp_path: Path, migrated_postgres_url: str) -> AsyncIterator[TowerWorld]:
    url = migrated_postgres_url.replace("postgresql://", "postgresql+asyncpg://")
    async with start_tower(tmp_path, database_url=url) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


async def ok(client: httpx.AsyncClient, method: str, path: str, status: int = 200, **body: Any) -> Any:
    answer = await client.request(method, f"{API}{path}", json=body or None)
    assert answer.status_code == status, (method, path, answer.text)
    return answer.json() if answer.content else None


async def test_accounts_sessions_and_passwords(world: TowerWorld, root: httpx.AsyncClient) -> None:
    made = await ok(root, "POST", "/users", 201, name="Jürgen", password=PASSWORD)
    assert_problem(await root.post(f"{API}/users", json={"name": "JÜRGEN", "password": PASSWORD}), 409, "name-taken")
    juergen = await world.signed_in("jürgen")
    assert_problem(await juergen.get(f"{API}/drones"), 403, "password-change-needed")
    await ok(juergen, "POST", "/me/password", old_password=PASSWORD, new_password="another password")
    await ok(root, "PATCH", f"/users/{made['id']}", role="admin")
    assert {one["user"]["name"] for one in await ok(juergen, "GET", "/sessions?everybody=true")} == {"Root", "Jürgen"}
    (session,) = [one for one in await ok(juergen, "GET", "/sessions") if one["current"]]
    await ok(root, "DELETE", f"/sessions/{session['id']}", 204)
    assert_problem(await juergen.get(f"{API}/me"), 401, "session-expired")
    await ok(root, "PATCH", f"/users/{made['id']}", disabled=True)
    await ok(root, "DELETE", f"/users/{made['id']}", 204)
    me = await ok(root, "GET", "/me")
    assert_problem(await root.delete(f"{API}/users/{me['id']}"), 409, "last-admin")
    for name in (r"\u0000", r"\udc00", r"a\u0000b"):
        body = f'{{"name": "{name}", "password": "{name}"}}'
        stranger = await world.client(headers={"content-type": "application/json"})
        answer = await stranger.post(f"{API}/session", content=body)
        assert answer.status_code in (401, 422), answer.text


async def test_a_second_factor(world: TowerWorld, root: httpx.AsyncClient, anna: Person) -> None:
    client = await world.signed_in(anna)
    secret = (await ok(client, "POST", "/me/second-factor"))["secret"]

    def code() -> str:
        world.clock.advance(30)
        return pyotp.TOTP(secret).at(world.clock())

    codes = (await ok(client, "POST", "/me/second-factor/confirm", code=code()))["recovery_codes"]
    for used in (code(), codes[0]):
        body = {"name": "Anna", "password": PASSWORD, "code": used}
        assert (await (await world.client()).post(f"{API}/session", json=body)).status_code == 200
        assert_problem(await (await world.client()).post(f"{API}/session", json=body), 401, "wrong-code")
    renewed = await ok(client, "POST", "/me/second-factor/recovery-codes")
    proof = {"password": PASSWORD, "code": renewed["recovery_codes"][0]}
    assert (await ok(client, "POST", "/session/proof", **proof))["fresh"] is True
    assert_problem(await client.post(f"{API}/session/proof", json=proof), 403, "code-refused")
    await ok(client, "POST", "/me/second-factor/remove", 204)
    assert (await ok(root, "DELETE", f"/users/{anna.id}/second-factor"))["second_factor"] is False


async def test_tokens_and_preferences(world: TowerWorld, root: httpx.AsyncClient, anna: Person) -> None:
    client = await world.signed_in(anna)
    ends = (world.clock() + timedelta(seconds=90)).isoformat()
    made = await ok(client, "POST", "/tokens", 201, name="GCS", scopes=["watch"], expires_at=ends)
    program = await world.client(headers={"Authorization": f"Bearer {made['secret']}"})
    await ok(program, "GET", "/drones")
    assert (await ok(root, "GET", "/tokens?everybody=true"))[0]["last_used_at"] is not None
    world.clock.advance(91)
    assert_problem(await program.get(f"{API}/drones"), 401, "bad-token")
    await ok(client, "DELETE", f"/tokens/{made['token']['id']}", 204)
    for document in ({"units": "metric", "x": [1, None, "ü"]}, {"units": "feet"}):
        await ok(client, "PUT", "/me/preferences/units", 204, **document)
        assert await ok(client, "GET", "/me/preferences") == {"units": document}
    answer = await client.put(f"{API}/me/preferences/units", json={"text": "a\0b"})
    assert answer.status_code in (204, 422), answer.text


async def test_drones_owners_loans_and_enrolment(world: TowerWorld, root: httpx.AsyncClient, anna: Person) -> None:
    drone = (await ok(root, "POST", "/drones", 201, name="Kestrel"))["drone"]["id"]
    await ok(root, "PATCH", f"/drones/{drone}", name="Merlin")
    await ok(root, "PUT", f"/drones/{drone}/owners/{anna.id}")
    await ok(root, "DELETE", f"/drones/{drone}/owners/{anna.id}")
    await ok(root, "PATCH", f"/drones/{drone}/settings", lost_action="land")
    until_ = (world.clock() + timedelta(seconds=600)).isoformat()
    for height_m in (50, 60.5):
        reported = await ok(root, "PUT", f"/drones/{drone}/loans/{anna.id}", until=until_, max_height_m=height_m)
        assert reported["loans"][0]["max_height_m"] == height_m
    first = await ok(root, "POST", f"/drones/{drone}/enrolments", 201, lasts_s=60)
    second = await ok(root, "POST", f"/drones/{drone}/enrolments", 201, lasts_s=60)
    companion = await world.client()
    key, another = (DroneKey(DroneId(drone), bytes([number]) * 32) for number in (1, 2))
    for begun, signer, status in ((first, key, 403), (second, key, 200), (second, another, 403)):
        answer = await companion.post(f"{API}/enrol", json=asked(begun["token"], signer))
        assert answer.status_code == status, answer.text
    third = await ok(root, "POST", f"/drones/{drone}/enrolments", 201, lasts_s=60)
    await ok(root, "DELETE", f"/enrolments/{third['enrolment']['id']}", 204)
    assert [one["state"] for one in await ok(root, "GET", "/enrolments")] == ["cancelled", "used", "cancelled"]
    agent = ObedientAgent(world.tower.hub, drone)
    agent.state(armed=True, airborne=True)
    borrower = await world.signed_in(anna)
    assert (await ask(borrower, drone, "acquire")).status_code == 200
    odd = rb'{"reason": "a\u0000b \ud800"}'
    path = f"{API}/drones/{drone}/control/release"
    answer = await borrower.post(path, content=odd, headers={"content-type": "application/json"})
    assert answer.status_code in (200, 422), answer.text
    if answer.status_code == 200:
        assert (await ask(borrower, drone, "acquire")).status_code == 200
    for what in ("take", "give"):
        assert (await ask(root, drone, what)).status_code == 200
    assert (await ask(borrower, drone, "accept", sticks_centred=True)).status_code == 200
    world.clock.advance(601)
    live = world.tower.hub.state.drones.get(DroneId(drone))
    assert live is not None
    await until("the end of the loan", lambda: live.lease.holder is None and not live.record.loans)
    await ok(root, "DELETE", f"/drones/{drone}", 204)


async def test_the_library_of_missions(world: TowerWorld, root: httpx.AsyncClient, anna: Person) -> None:
    body = {"name": "field", "document": {"mission": [], "fence": [], "rally": []}, "shared": True}
    hers = await world.signed_in(anna)
    path = f"/missions/{(await ok(hers, 'POST', '/missions', 201, **body))['id']}"
    changes = [root.put(f"{API}{path}", json=body, headers={"If-Match": '"1"'}) for _ in range(3)]
    assert sorted(one.status_code for one in await asyncio.gather(*changes)) == [200, 412, 412]
    assert (await ok(hers, "GET", path))["version"] == 2
    assert [one["name"] for one in await ok(root, "GET", "/missions")] == ["field"]
    await ok(root, "DELETE", path, 204)
    assert await ok(hers, "GET", "/missions") == []


async def test_the_audit_trail_and_the_system(world: TowerWorld, root: httpx.AsyncClient, anna: Person) -> None:
    await world.signed_in(anna)
    assert [one["actor_name"] for one in await audit(root, "session.began")] == ["Anna", "Root"]
    since = (world.clock() - timedelta(hours=1)).isoformat().replace("+00:00", "Z")
    found = await ok(root, "GET", f"/audit?action=session.&actor=ANNA&since={since}&limit=5")
    assert [one["action"] for one in found] == ["session.began"]
    assert "session.began" in (await root.get(f"{API}/audit.csv")).text
    for odd in ("%00", "%25", "_", "%5C", "'"):
        assert (await root.get(f"{API}/audit?actor={odd}&action={odd}.")).status_code in (200, 422)
    system = await ok(root, "GET", "/system")
    assert (system["database"]["kind"], system["database"]["revision"]) == ("postgresql", newest_revision())
    assert system["database"]["size_bytes"] > 0
    assert (await root.get("/metrics")).status_code == 200
