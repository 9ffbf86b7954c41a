"""Passkeys are added, named, removed and reset, with limits and proofs."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pyotp
import pytest
from control_world import audit
from passkey_sign_in import CREATION, ME, SESSION, refusals, with_password
from passkey_world import (
    OPTIONS,
    PASSKEYS,
    PUBLIC_URL,
    Owner,
    added,
    asked,
    new_authenticator,
    new_owner,
    signs_in,
)
from sqlalchemy import func, select, update
from tower_world import TowerWorld, assert_problem, start_tower
from worlds.soft_authenticator import unb64

from server.accounts.core.challenges import ASKED_AT_ONCE
from server.accounts.store.passkeys import MAX_PER_USER
from server.accounts.store.tables import PasskeyRow, RecoveryCodeRow, UserRow
from server.kernel.people import Role

PROOF = f"{SESSION}/proof"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path, public_url=PUBLIC_URL) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Owner:
    return await new_owner(world, await world.add_user("Anna"))


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def test_recovery_codes_come_with_the_first_factor_and_go_with_the_last(world: TowerWorld, anna: Owner) -> None:
    assert len(set(anna.recovery_codes)) == 10
    assert (await with_password(world, code=anna.recovery_codes[0])).status_code == 200
    assert_problem(await with_password(world, code=anna.recovery_codes[0]), 401, "wrong-code")
    assert_problem(await with_password(world, code="000000"), 401, "wrong-code")
    # A second factor of the other kind makes no new codes, and after removal of the passkeys it keeps the existing
    # ones.
    secret = (await anna.client.post(f"{ME}/second-factor")).json()["secret"]
    code = pyotp.TOTP(secret).at(world.clock())
    confirmed = await anna.client.post(f"{ME}/second-factor/confirm", json={"code": code})
    assert confirmed.json() == {"recovery_codes": []}
    needed = assert_problem(await with_password(world), 401, "second-factor-needed")
    assert needed["kinds"] == ["passkey", "code"]
    assert (await anna.client.delete(f"{PASSKEYS}/{anna.passkey_id}")).status_code == 204
    assert (await with_password(world, code=anna.recovery_codes[1])).status_code == 200
    again = await added(anna.client, new_authenticator())
    assert again.json()["recovery_codes"] == []
    assert (await anna.client.post(f"{ME}/second-factor/remove")).status_code == 204
    assert (await with_password(world, code=anna.recovery_codes[2])).status_code == 200
    last = (await anna.client.get(PASSKEYS)).json()[0]["id"]
    assert (await anna.client.delete(f"{PASSKEYS}/{last}")).status_code == 204
    async with world.database.reading() as session:
        assert await session.scalar(select(func.count()).select_from(RecoveryCodeRow)) == 0
    assert (await with_password(world)).status_code == 200


async def test_several_passkeys_have_names_and_each_is_removed_alone(
    world: TowerWorld, anna: Owner, root: httpx.AsyncClient
) -> None:
    key = new_authenticator()
    second = (await added(anna.client, key, "  key on the ring ")).json()["passkey"]
    assert second["name"] == "key on the ring"
    renamed = await anna.client.patch(f"{PASSKEYS}/{second['id']}", json={"name": "blue key"})
    assert renamed.json()["name"] == "blue key"
    assert_problem(await anna.client.patch(f"{PASSKEYS}/{second['id']}", json={"name": " "}), 422, "invalid-request")
    assert (await signs_in(await world.client(), key)).status_code == 200
    assert (await anna.client.delete(f"{PASSKEYS}/{second['id']}")).status_code == 204
    assert_problem(await signs_in(await world.client(), key), 401, "passkey-refused")
    assert (await signs_in(await world.client(), anna.authenticator)).status_code == 200
    assert [one["name"] for one in (await anna.client.get(PASSKEYS)).json()] == ["telephone"]
    events = [(one["action"], one["detail"]["passkey"]) for one in await audit(root, "passkey.")]
    assert events == [
        ("passkey.removed", "blue key"),
        ("passkey.renamed", "blue key"),
        ("passkey.added", "key on the ring"),
        ("passkey.added", "telephone"),
    ]


async def test_nobody_touches_the_passkeys_of_others(world: TowerWorld, anna: Owner, root: httpx.AsyncClient) -> None:
    for client in (await world.signed_in(await world.add_user("Bert")), root):
        path = f"{PASSKEYS}/{anna.passkey_id}"
        assert_problem(await client.patch(path, json={"name": "mine"}), 404, "unknown-passkey")
        assert_problem(await client.delete(path), 404, "unknown-passkey")
        assert (await client.get(PASSKEYS)).json() == []


async def test_a_credential_that_is_there_is_not_added_again(world: TowerWorld, anna: Owner) -> None:
    """For any account: otherwise it would sign in to the account that added it last."""
    bert = await world.signed_in(await world.add_user("Bert"))
    thief = new_authenticator()
    made = thief.make(await asked(bert, f"{PASSKEYS}/options"))
    async with world.database.writing() as session:
        await session.execute(update(PasskeyRow).values(credential_id=unb64(made["rawId"])))
    assert_problem(await bert.post(PASSKEYS, json={"name": "mine", "credential": made}), 409, "passkey-known")


async def test_a_wrong_new_passkey_is_not_added(world: TowerWorld) -> None:
    client = await world.signed_in(await world.add_user("Bert"))
    wrong: tuple[dict[str, Any], ...] = (
        {"origin": "https://evil.example"},
        {"party_id": "evil.example"},
        {"is_verified": False},
    )
    for faults in wrong:
        assert_problem(await added(client, new_authenticator(), **faults), 403, "wrong-passkey")
    assert (await client.get(PASSKEYS)).json() == []
    assert (await client.get(ME)).json()["second_factor"] is False


async def test_a_new_passkey_is_for_the_session_that_asked(world: TowerWorld, anna: Owner) -> None:
    elsewhere = await world.client()
    assert (await signs_in(elsewhere, anna.authenticator)).status_code == 200
    made = new_authenticator().make(await asked(elsewhere, f"{PASSKEYS}/options"))
    body = {"name": "mine", "credential": made}
    assert_problem(await anna.client.post(PASSKEYS, json=body), 409, "challenge-over")
    assert_problem(await elsewhere.post(PASSKEYS, json=body), 409, "challenge-over")


async def test_there_are_so_many_of_one_user_at_most_even_at_the_same_moment(world: TowerWorld, anna: Owner) -> None:
    bodies = []
    for number in range(MAX_PER_USER + 1):
        made = new_authenticator().make(await asked(anna.client, f"{PASSKEYS}/options"))
        bodies.append({"name": f"key {number}", "credential": made})
    answers = await asyncio.gather(*(anna.client.post(PASSKEYS, json=body) for body in bodies))
    assert sorted(one.status_code for one in answers) == [201] * (MAX_PER_USER - 1) + [409] * 2
    assert_problem(await anna.client.post(f"{PASSKEYS}/options"), 409, "too-many-passkeys")
    async with world.database.reading() as session:
        kept = await session.scalar(select(func.count()).select_from(PasskeyRow))
        counted = await session.scalar(select(UserRow.passkey_count).where(UserRow.id == anna.person.id))
    assert kept == counted == MAX_PER_USER


async def test_an_admin_takes_them_from_who_has_lost_them(
    world: TowerWorld, anna: Owner, root: httpx.AsyncClient
) -> None:
    user = f"/api/v1/users/{anna.person.id}"
    assert (await root.get(user)).json()["passkeys"] == 1
    answer = (await root.delete(f"{user}/second-factor")).json()
    assert (answer["second_factor"], answer["passkeys"]) == (False, 0)
    assert_problem(await signs_in(await world.client(), anna.authenticator), 401, "passkey-refused")
    assert_problem(await with_password(world, password="wrong"), 401, "wrong-sign-in")
    assert (await with_password(world)).status_code == 200
    removed = (await audit(root, "passkey.removed"))[0]
    assert (removed["actor_name"], removed["detail"]["user"]) == ("Root", "Anna")


async def test_they_are_gone_with_their_user(world: TowerWorld, anna: Owner, root: httpx.AsyncClient) -> None:
    assert (await root.delete(f"/api/v1/users/{anna.person.id}")).status_code == 204
    async with world.database.reading() as session:
        assert await session.scalar(select(func.count()).select_from(PasskeyRow)) == 0
    assert_problem(await signs_in(await world.client(), anna.authenticator), 401, "passkey-refused")


async def test_a_passkey_is_a_fresh_proof_and_adding_and_removing_need_one(
    world: TowerWorld, anna: Owner, root: httpx.AsyncClient
) -> None:
    other = await world.client()
    assert (await signs_in(other, anna.authenticator)).status_code == 200
    world.clock.advance(301)
    path = f"{PASSKEYS}/{anna.passkey_id}"
    for refused in (
        await anna.client.post(f"{PASSKEYS}/options"),
        await anna.client.post(PASSKEYS, json={"name": "x", "credential": new_authenticator().make(CREATION)}),
        await anna.client.patch(path, json={"name": "x"}),
        await anna.client.delete(path),
    ):
        assert_problem(refused, 403, "proof-needed")
    proof = (await anna.client.get(PROOF)).json()
    assert (proof["fresh"], proof["kinds"]) == (False, ["passkey", "password"])

    async def proves(client: httpx.AsyncClient, **faults: Any) -> httpx.Response:
        options = await asked(client, f"{PROOF}/passkey")
        assert [unb64(one["id"]) for one in options["allowCredentials"]] == [anna.authenticator.credentials[0].id]
        answer = anna.authenticator.get(options, **faults)
        return await client.post(PROOF, json={"kind": "passkey", "credential": answer})

    assert_problem(await proves(anna.client, tamper=True), 403, "wrong-passkey")
    assert_problem(await proves(anna.client, is_verified=False), 403, "wrong-passkey")
    assert (await refusals(root))[0] == "passkey: the person was not verified"
    # The challenge of one session proves nothing in another, and neither does a sign-in response.
    options = await asked(anna.client, f"{PROOF}/passkey")
    stolen = {"kind": "passkey", "credential": anna.authenticator.get(options)}
    assert_problem(await other.post(PROOF, json=stolen), 409, "challenge-over")
    before_sign_in = {"kind": "passkey", "credential": anna.authenticator.get(await asked(anna.client))}
    assert_problem(await anna.client.post(PROOF, json=before_sign_in), 409, "challenge-over")
    bert = await new_owner(world, await world.add_user("Bert"))
    options = await asked(anna.client, f"{PROOF}/passkey")
    of_bert = bert.authenticator.get(options | {"allowCredentials": []})
    foreign = await anna.client.post(PROOF, json={"kind": "passkey", "credential": of_bert})
    assert_problem(foreign, 403, "wrong-passkey")
    assert (await anna.client.get(PROOF)).json()["fresh"] is False

    answer = await proves(anna.client)
    assert answer.status_code == 200, answer.text
    assert answer.json()["fresh"] is True
    assert (await audit(root, "session.proved"))[0]["detail"]["kind"] == "passkey"
    # A new factor invalidates the proofs of the person's other sessions.
    assert (await proves(other)).status_code == 200
    assert (await added(anna.client, new_authenticator())).status_code == 201
    assert (await other.get(PROOF)).json()["fresh"] is False
    assert (await anna.client.delete(path)).status_code == 204


async def test_an_admin_of_whom_a_factor_is_demanded_adds_a_passkey_and_keeps_one(tmp_path: Path) -> None:
    async with start_tower(tmp_path, public_url=PUBLIC_URL, admins_need_second_factor=True) as world:
        client = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        assert_problem(await client.get("/api/v1/users"), 403, "second-factor-demanded")
        first = (await added(client, new_authenticator())).json()["passkey"]["id"]
        assert (await client.get("/api/v1/users")).status_code == 200
        assert_problem(await client.delete(f"{PASSKEYS}/{first}"), 409, "last-factor")
        secret = (await client.post(f"{ME}/second-factor")).json()["secret"]
        code = pyotp.TOTP(secret).at(world.clock())
        assert (await client.post(f"{ME}/second-factor/confirm", json={"code": code})).status_code == 200
        assert (await client.delete(f"{PASSKEYS}/{first}")).status_code == 204
        assert_problem(await client.post(f"{ME}/second-factor/remove"), 409, "last-factor")
        second = (await added(client, new_authenticator())).json()["passkey"]["id"]
        assert (await client.post(f"{ME}/second-factor/remove")).status_code == 204
        assert_problem(await client.delete(f"{PASSKEYS}/{second}"), 409, "last-factor")
        anna = await new_owner(world, await world.add_user("Anna"))
        assert (await anna.client.delete(f"{PASSKEYS}/{anna.passkey_id}")).status_code == 204


async def test_passkeys_are_a_way_in_while_passwords_are_flooded(
    world: TowerWorld, anna: Owner, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def full(*_: object) -> bool:
        raise AssertionError("a password was hashed")

    monkeypatch.setattr(type(world.tower.passwords), "verify", full)
    monkeypatch.setattr(type(world.tower.passwords), "hash", full)
    for _ in range(100):  # and the password throttle is full for this address and name
        world.tower.sign_in.throttle.begin(name="anna", address="127.0.0.1", now_s=world.clock().timestamp())
    assert (await signs_in(await world.client(), anna.authenticator)).status_code == 200


async def test_asking_for_challenges_has_a_bound_of_its_own(world: TowerWorld, anna: Owner) -> None:
    world.clock.stop()
    browser = await world.client()
    statuses = [(await browser.post(OPTIONS)).status_code for _ in range(ASKED_AT_ONCE + 2)]
    # Adding the passkey took one.
    assert statuses == [200] * (ASKED_AT_ONCE - 1) + [429] * 3
    refused = await browser.post(OPTIONS)
    assert_problem(refused, 429, "too-many-tries")
    assert refused.headers["Retry-After"] == "1"
    world.clock.advance(1)
    assert (await signs_in(browser, anna.authenticator)).status_code == 200


async def test_where_passkeys_cannot_work_the_answer_says_why(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        browser = await world.client()
        refused = assert_problem(await browser.post(OPTIONS), 409, "passkeys-unavailable")
        assert "TOWER_PUBLIC_URL" in refused["detail"]
        anna = await world.signed_in(await world.add_user("Anna"))
        assert_problem(await anna.post(f"{PASSKEYS}/options"), 409, "passkeys-unavailable")
        # On the local machine, by its name: for development.
        port = int(world.base_url.rpartition(":")[2])
        headers = {"Host": f"localhost:{port}"}
        options = (await browser.post(OPTIONS, headers=headers)).json()["public_key"]
        assert options["rpId"] == "localhost"


async def test_the_cookie_of_a_browser_is_kept_from_scripts_and_from_other_paths(world: TowerWorld) -> None:
    browser = await world.client()
    answer = await browser.post(OPTIONS)
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert "path=/api/v1/session" in cookie
