"""Signing in and out over a real socket: what is accepted, what is refused, and how long it lasts."""

from pathlib import Path

import pytest
from sqlalchemy import select, update
from tower_world import PASSWORD, Person, TowerWorld, assert_problem, start_tower

from server.accounts.store.tables import SessionRow, UserRow
from server.audit.store.tables import AuditEventRow

SESSION = "/api/v1/session"
IDLE_S, LIFETIME_S = 600.0, 3600.0


@pytest.fixture
async def world(tmp_path: Path):
    async with start_tower(tmp_path, session_idle_s=IDLE_S, session_lifetime_s=LIFETIME_S) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


async def test_sign_in_answers_the_user_and_a_guarded_cookie(world: TowerWorld, anna: Person) -> None:
    client = await world.client()
    answer = await client.post(SESSION, json={"name": " aNNa ", "password": PASSWORD})
    assert answer.status_code == 200
    assert answer.json() == {
        "id": anna.id,
        "name": "Anna",
        "role": "operator",
        "must_change_password": False,
        "second_factor": False,
        "must_add_second_factor": False,
    }
    cookie = answer.headers["set-cookie"].lower()
    assert cookie.startswith("tower_session=")
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert "path=/" in cookie
    assert "secure" not in cookie
    assert (await client.get("/api/v1/me")).json() == answer.json()


async def test_behind_a_tls_proxy_the_cookie_is_secure(world: TowerWorld, anna: Person) -> None:
    client = await world.client(headers={"X-Forwarded-Proto": "https"})
    answer = await client.post(SESSION, json={"name": "Anna", "password": PASSWORD})
    assert "secure" in answer.headers["set-cookie"].lower()


async def test_the_database_does_not_know_the_token(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    async with world.database.reading() as session:
        row = await session.scalar(select(SessionRow))
    assert row is not None
    assert len(row.token_hash) == 64
    assert row.token_hash != client.cookies["tower_session"]


@pytest.mark.parametrize(("name", "password"), [("Anna", "wrong"), ("Nobody", PASSWORD), ("Anna", ""), ("", "")])
async def test_wrong_name_and_wrong_password_get_the_same_answer(
    world: TowerWorld, anna: Person, name: str, password: str
) -> None:
    client = await world.client()
    answer = await client.post(SESSION, json={"name": name, "password": password})
    document = assert_problem(answer, 401, "wrong-sign-in")
    assert document["detail"] == "the name or the password is wrong"
    assert "set-cookie" not in answer.headers


async def test_a_disabled_user_gets_the_same_answer(world: TowerWorld, anna: Person) -> None:
    async with world.database.writing() as session:
        await session.execute(update(UserRow).values(disabled=True))
    client = await world.client()
    assert_problem(await client.post(SESSION, json={"name": "Anna", "password": PASSWORD}), 401, "wrong-sign-in")


async def test_after_a_few_failures_one_has_to_wait_and_then_may_again(world: TowerWorld, anna: Person) -> None:
    world.clock.stop()
    client = await world.client()
    for _ in range(5):
        await client.post(SESSION, json={"name": "Anna", "password": "wrong"})
    answer = await client.post(SESSION, json={"name": "Anna", "password": PASSWORD})
    assert_problem(answer, 429, "too-many-tries")
    wait_s = int(answer.headers["retry-after"])
    assert wait_s >= 1
    world.clock.advance(wait_s)
    assert (await client.post(SESSION, json={"name": "Anna", "password": PASSWORD})).status_code == 200


async def test_no_cookie_and_ended_session_are_told_apart(world: TowerWorld) -> None:
    client = await world.client()
    assert_problem(await client.get("/api/v1/me"), 401, "not-signed-in")
    made_up = await world.client(cookies={"tower_session": "made-up"})
    assert_problem(await made_up.get("/api/v1/me"), 401, "session-expired")


async def test_an_idle_session_ends_and_a_used_one_goes_on(world: TowerWorld, anna: Person) -> None:
    used, idle = await world.signed_in(anna), await world.signed_in(anna)
    for _ in range(3):
        world.clock.advance(IDLE_S - 100)
        assert (await used.get("/api/v1/me")).status_code == 200
    assert_problem(await idle.get("/api/v1/me"), 401, "session-expired")


async def test_even_a_used_session_ends_after_its_lifetime(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    lived_s = 0.0
    while lived_s + IDLE_S / 2 < LIFETIME_S:
        world.clock.advance(IDLE_S / 2)
        lived_s += IDLE_S / 2
        assert (await client.get("/api/v1/me")).status_code == 200
    world.clock.advance(IDLE_S / 2)
    assert_problem(await client.get("/api/v1/me"), 401, "session-expired")


async def test_signs_of_life_are_written_once_a_minute(world: TowerWorld, anna: Person) -> None:
    async def last_seen():
        async with world.database.reading() as session:
            return await session.scalar(select(SessionRow.last_seen_at))

    client = await world.signed_in(anna)
    before = await last_seen()
    await client.get("/api/v1/me")
    assert await last_seen() == before
    world.clock.advance(61)
    await client.get("/api/v1/me")
    assert await last_seen() > before


async def test_signing_in_again_ends_the_session_before(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    old = await world.client(cookies={"tower_session": client.cookies["tower_session"]})
    assert (await client.post(SESSION, json={"name": "Anna", "password": PASSWORD})).status_code == 200
    assert client.cookies["tower_session"] != old.cookies["tower_session"]
    assert (await client.get("/api/v1/me")).status_code == 200
    assert_problem(await old.get("/api/v1/me"), 401, "session-expired")


async def test_a_cookie_that_somebody_planted_is_not_taken_over(world: TowerWorld, anna: Person) -> None:
    client = await world.client(cookies={"tower_session": "planted"})
    answer = await client.post(SESSION, json={"name": "Anna", "password": PASSWORD})
    assert "planted" not in answer.headers["set-cookie"]
    planted = await world.client(cookies={"tower_session": "planted"})
    assert_problem(await planted.get("/api/v1/me"), 401, "session-expired")


async def test_signing_out_ends_the_session(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    kept = await world.client(cookies={"tower_session": client.cookies["tower_session"]})
    answer = await client.delete(SESSION)
    assert answer.status_code == 204
    assert "tower_session" not in client.cookies
    assert_problem(await kept.get("/api/v1/me"), 401, "session-expired")
    assert (await client.delete(SESSION)).status_code == 204


async def test_sessions_outlive_the_tower(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as first:
        client = await first.signed_in(await first.add_user("Anna"))
        token = client.cookies["tower_session"]
    async with start_tower(tmp_path) as second:
        client = await second.client(cookies={"tower_session": token})
        assert (await client.get("/api/v1/me")).json()["name"] == "Anna"


async def test_the_trail_tells_of_sign_ins_and_never_of_what_was_typed(world: TowerWorld, anna: Person) -> None:
    client = await world.client()
    await client.post(SESSION, json={"name": "hunter2-typed-as-name", "password": "secret-typed"})
    await client.post(SESSION, json={"name": "Anna", "password": "secret-typed"})
    await client.post(SESSION, json={"name": "Anna", "password": PASSWORD})
    await client.delete(SESSION)
    async with world.database.reading() as session:
        rows = list(await session.scalars(select(AuditEventRow).order_by(AuditEventRow.id)))
    reported = [(row.action, row.actor_name) for row in rows if row.action.startswith("session.")]
    assert reported == [
        ("session.refused", "unknown"),
        ("session.refused", "Anna"),
        ("session.began", "Anna"),
        ("session.ended", "Anna"),
    ]
    everything = " ".join(f"{row.actor_name} {row.detail} {row.address}" for row in rows)
    assert "typed" not in everything
    assert PASSWORD not in everything
    assert rows[-1].address == "127.0.0.1"


async def test_a_hash_of_yesterdays_costs_is_renewed(tmp_path: Path) -> None:
    async def stored(world: TowerWorld) -> str:
        async with world.database.reading() as session:
            return await session.scalar(select(UserRow.password_hash)) or ""

    async with start_tower(tmp_path) as world:
        await world.add_user("Anna")
        before = await stored(world)
    async with start_tower(tmp_path, argon2_rounds=2) as world:
        await world.signed_in("Anna")
        after = await stored(world)
        await world.signed_in("Anna")
    assert "t=1" in before
    assert "t=2" in after


@pytest.mark.parametrize("text", ["\\u0000", "\\ud800", "a\\udfffb", "\\u202e", "x" * 5000])
async def test_odd_characters_are_answered_and_break_nothing(world: TowerWorld, anna: Person, text: str) -> None:
    client = await world.client(headers={"content-type": "application/json"})
    for name, password in ((text, PASSWORD), ("Anna", text * 2), (text, text)):
        body = f'{{"name": "{name}", "password": "{password}"}}'
        answer = await client.post(SESSION, content=body)
        assert answer.status_code in {401, 422}, answer.text
        assert answer.headers["content-type"] == "application/problem+json"
