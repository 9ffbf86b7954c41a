"""The console's stored preferences: returned unchanged, limited in size, private, and deleted with the account."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from sqlalchemy import select
from tower_world import TowerWorld, assert_problem, start_tower

from server.accounts.store.preferences import MAX_DEPTH, MAX_DOCUMENT_BYTES, MAX_DOCUMENTS
from server.accounts.store.tables import PreferenceRow
from server.kernel.people import Role

PREFERENCES = "/api/v1/me/preferences"
STICKS = {"version": 1, "mode": 2, "pads": {"Some pad (Vendor: 045e)": {"expo": 0.3, "names": "Müller ☂"}}}


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


async def test_it_is_kept_as_it_was_and_is_nobody_elses(world: TowerWorld) -> None:
    anna = await world.signed_in(await world.add_user("Anna"))
    bert = await world.signed_in(await world.add_user("Bert"))
    assert (await anna.get(PREFERENCES)).json() == {}
    for document in ({"version": 0}, STICKS):
        assert (await anna.put(f"{PREFERENCES}/sticks", json=document)).status_code == 204
    assert (await anna.put(f"{PREFERENCES}/display", json={"a": 1})).status_code == 204
    assert (await anna.get(PREFERENCES)).json() == {"sticks": STICKS, "display": {"a": 1}}
    assert (await bert.get(PREFERENCES)).json() == {}
    assert (await anna.put(f"{PREFERENCES}/display", json={})).status_code == 204
    assert (await anna.get(PREFERENCES)).json() == {"sticks": STICKS}


async def test_what_is_too_much_is_refused_and_nothing_is_lost(world: TowerWorld) -> None:
    anna = await world.signed_in(await world.add_user("Anna"))
    await anna.put(f"{PREFERENCES}/sticks", json=STICKS)
    fits = {"x": "ü" * ((MAX_DOCUMENT_BYTES - len('{"x":""}')) // 2)}
    assert (await anna.put(f"{PREFERENCES}/full", json=fits)).status_code == 204
    too_large = await anna.put(f"{PREFERENCES}/sticks", json={"x": fits["x"] + "1"})
    assert_problem(too_large, 413, "too-large")
    for number in range(MAX_DOCUMENTS - 2):
        assert (await anna.put(f"{PREFERENCES}/number-{number}", json={"n": number})).status_code == 204
    assert_problem(await anna.put(f"{PREFERENCES}/one-more", json={"n": 0}), 409, "too-many-preferences")
    assert (await anna.put(f"{PREFERENCES}/number-0", json={"n": "changed"})).status_code == 204
    kept = (await anna.get(PREFERENCES)).json()
    assert len(kept) == MAX_DOCUMENTS
    assert kept["sticks"] == STICKS


@pytest.mark.parametrize(("name", "body"), [("Sticks", {}), ("a" * 33, {}), ("sticks", []), ("sticks", "text")])
async def test_what_makes_no_sense_is_said(world: TowerWorld, name: str, body: object) -> None:
    anna = await world.signed_in(await world.add_user("Anna"))
    assert_problem(await anna.put(f"{PREFERENCES}/{name}", json=body), 422, "invalid-request")


@pytest.mark.parametrize("body", ['{"x": NaN}', '{"x": [1e999]}', '{"x": "\\ud800"}', '{"\\udfff": 1}'])
async def test_what_could_not_be_told_back_is_not_kept(world: TowerWorld, body: str) -> None:
    anna = await world.signed_in(await world.add_user("Anna"))
    headers = {"Content-Type": "application/json"}
    assert_problem(await anna.put(f"{PREFERENCES}/sticks", content=body, headers=headers), 422, "invalid-request")
    assert (await anna.get(PREFERENCES)).json() == {}


async def test_not_with_a_token_not_for_strangers_and_gone_with_the_account(world: TowerWorld) -> None:
    stranger = await world.client()
    assert_problem(await stranger.get(PREFERENCES), 401, "not-signed-in")
    assert_problem(await stranger.put(f"{PREFERENCES}/sticks", json=STICKS), 401, "not-signed-in")

    person = await world.add_user("Anna")
    anna = await world.signed_in(person)
    await anna.put(f"{PREFERENCES}/sticks", json=STICKS)
    reported = await anna.post("/api/v1/tokens", json={"name": "a program", "scopes": ["watch", "fly"]})
    program = await world.client(headers={"Authorization": f"Bearer {reported.json()['secret']}"})
    assert (await program.get(PREFERENCES)).json() == {"sticks": STICKS}
    assert_problem(await program.put(f"{PREFERENCES}/sticks", json={"version": 1}), 403, "in-person-only")

    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    assert (await root.delete(f"/api/v1/users/{person.id}")).status_code == 204
    async with world.database.reading() as session:
        assert list(await session.scalars(select(PreferenceRow))) == []


def nested(depth: int) -> dict[str, object]:
    """Returns objects and lists nested this deep."""
    inner: object = 1
    for number in range(depth - 1):
        inner = [inner] if number % 2 else {"a": inner}
    return {"x": inner}


async def test_what_is_nested_too_deep_is_refused_and_an_old_one_stops_no_reading(world: TowerWorld) -> None:
    """Before the fix, a depth of 256 was accepted, and every later read returned 500."""
    anna = await world.add_user("Anna")
    client = await world.signed_in(anna)
    assert (await client.put(f"{PREFERENCES}/sticks", json=STICKS)).status_code == 204
    assert (await client.put(f"{PREFERENCES}/deep", json=nested(MAX_DEPTH))).status_code == 204
    for depth in (MAX_DEPTH + 1, 256):
        assert_problem(await client.put(f"{PREFERENCES}/deep", json=nested(depth)), 422, "invalid-request")
    kept = {"sticks": STICKS, "deep": nested(MAX_DEPTH)}
    assert (await client.get(PREFERENCES)).json() == kept
    async with world.database.writing() as session:
        row = PreferenceRow(user_id=anna.id, name="old", document=nested(256), changed_at=world.clock())
        session.add(row)
    assert (await client.get(PREFERENCES)).json() == kept
    assert (await client.put(f"{PREFERENCES}/old", json={})).status_code == 204, "it can be taken away"
