"""Passkeys over real sockets, with an authenticator of our own: added, signed in with, refused, removed, reset."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pyotp
import pytest
from control_world import audit
from passkey_world import (
    OPTIONS,
    PARTY_ID,
    PASSKEYS,
    PUBLIC_URL,
    SIGN_IN,
    Owner,
    added,
    asked,
    new_authenticator,
    new_owner,
    signs_in,
)
from sqlalchemy import func, select, update
from tower_world import PASSWORD, TowerWorld, assert_problem, start_tower
from worlds.soft_authenticator import b64, unb64

from server.domain.people import Role
from server.live.accounts.challenges import ASKED_AT_ONCE, LIFETIME_S
from server.store.accounts.passkeys import MAX_PER_USER
from server.store.accounts.tables import PasskeyRow, RecoveryCodeRow, UserRow

ME = "/api/v1/me"
SESSION = "/api/v1/session"
PROOF = f"{SESSION}/proof"
CREATION = {"rp": {"id": PARTY_ID}, "user": {"id": b64(bytes(32))}, "challenge": b64(bytes(32))}
"""Not asked for by any tower."""


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


async def with_password(world: TowerWorld, **more: Any) -> httpx.Response:
    return await (await world.client()).post(SESSION, json={"name": "Anna", "password": PASSWORD} | more)


async def refusals(root: httpx.AsyncClient) -> list[str]:
    """Why somebody was not let in, the newest first."""
    return [one["detail"]["why"] for one in await audit(root, "session.refused")]


async def test_a_passkey_is_added_and_signs_in_without_name_and_password(
    world: TowerWorld, anna: Owner, root: httpx.AsyncClient
) -> None:
    listed = (await anna.client.get(PASSKEYS)).json()
    assert [(one["name"], one["made_for"], one["synced"]) for one in listed] == [("telephone", PARTY_ID, False)]
    assert listed[0]["last_used_at"] is None
    assert (await anna.client.get(ME)).json()["second_factor"] is True

    browser = await world.client()
    options = await asked(browser)
    assert options["rpId"] == PARTY_ID
    assert len(unb64(options["challenge"])) == 32
    assert options["allowCredentials"] == []
    assert options["userVerification"] == "required"
    answer = await browser.post(SIGN_IN, json={"credential": anna.authenticator.get(options)})
    assert answer.status_code == 200, answer.text
    assert answer.json()["name"] == "Anna"
    assert (await browser.get(ME)).json()["id"] == anna.person.id
    assert (await browser.get(PASSKEYS)).json()[0]["last_used_at"] is not None
    began = (await audit(root, "session.began"))[0]
    assert (began["actor_name"], began["detail"]["passkey"]) == ("Anna", "telephone")
    # It ends like any session, and does not take the place of another one's.
    assert (await anna.client.get(ME)).status_code == 200
    assert (await browser.delete(SESSION)).status_code == 204
    assert_problem(await browser.get(ME), 401, "not-signed-in")


async def test_the_handle_is_random_and_the_same_for_all_passkeys_of_a_person(world: TowerWorld, anna: Owner) -> None:
    options = await asked(anna.client, f"{PASSKEYS}/options")
    handle = unb64(options["user"]["id"])
    assert len(handle) == 32
    assert handle == anna.authenticator.credentials[0].user_handle
    assert options["user"]["name"] == "Anna"
    # The same device does not make a second one.
    assert [unb64(one["id"]) for one in options["excludeCredentials"]] == [anna.authenticator.credentials[0].id]
    bert = await new_owner(world, await world.add_user("Bert"))
    assert bert.authenticator.credentials[0].user_handle != handle


FAULTS: dict[str, dict[str, Any]] = {
    "passkey: wrong origin": {"origin": "https://evil.example"},
    "passkey: made for another site": {"party_id": "evil.example"},
    "passkey: the person was not verified": {"is_verified": False},
    "passkey: wrong signature": {"tamper": True},
    "passkey: wrong user handle": {"user_handle": bytes(32)},
    "passkey: malformed": {"kind": "webauthn.create"},
}


async def test_a_wrong_answer_lets_nobody_in_and_is_written_down(
    world: TowerWorld, anna: Owner, root: httpx.AsyncClient
) -> None:
    browser = await world.client()
    for faults in FAULTS.values():
        assert_problem(await signs_in(browser, anna.authenticator, **faults), 401, "passkey-refused")
        assert_problem(await browser.get(ME), 401, "not-signed-in")
    assert await refusals(root) == list(reversed(FAULTS))
    assert (await signs_in(browser, anna.authenticator)).status_code == 200


async def test_a_challenge_is_good_once_in_time_and_in_the_browser_that_asked(world: TowerWorld, anna: Owner) -> None:
    browser, other = await world.client(), await world.client()
    answer = anna.authenticator.get(await asked(browser))
    await asked(other)
    # An answer that was caught on its way is worth nothing elsewhere, and then nowhere.
    assert_problem(await other.post(SIGN_IN, json={"credential": answer}), 409, "challenge-over")
    assert_problem(await browser.post(SIGN_IN, json={"credential": answer}), 409, "challenge-over")
    answer = anna.authenticator.get(await asked(browser))
    assert (await browser.post(SIGN_IN, json={"credential": answer})).status_code == 200
    assert_problem(await browser.post(SIGN_IN, json={"credential": answer}), 409, "challenge-over")
    made_up = anna.authenticator.get(await asked(browser), challenge=b64(bytes(32)))
    assert_problem(await browser.post(SIGN_IN, json={"credential": made_up}), 409, "challenge-over")
    # One that was given for adding a passkey signs nobody in.
    to_add = await asked(anna.client, f"{PASSKEYS}/options")
    misused = anna.authenticator.get({"challenge": to_add["challenge"], "rpId": PARTY_ID})
    assert_problem(await anna.client.post(SIGN_IN, json={"credential": misused}), 409, "challenge-over")
    late = anna.authenticator.get(await asked(browser))
    world.clock.advance(LIFETIME_S)
    assert_problem(await browser.post(SIGN_IN, json={"credential": late}), 409, "challenge-over")


async def test_two_tabs_of_a_browser_ask_beside_each_other(world: TowerWorld, anna: Owner) -> None:
    browser = await world.client()
    first, second = await asked(browser), await asked(browser)
    for options in (first, second):
        answer = await browser.post(SIGN_IN, json={"credential": anna.authenticator.get(options)})
        assert answer.status_code == 200, answer.text


async def test_a_counter_that_goes_back_is_refused_and_written_down(
    world: TowerWorld, anna: Owner, root: httpx.AsyncClient
) -> None:
    browser = await world.client()
    assert (await signs_in(browser, anna.authenticator, counter=7)).status_code == 200
    for counter in (7, 3, 0):
        assert_problem(await signs_in(browser, anna.authenticator, counter=counter), 401, "passkey-refused")
    assert await refusals(root) == ["passkey: its counter went back: there may be a copy of it"] * 3
    assert (await signs_in(browser, anna.authenticator, counter=8)).status_code == 200


async def test_one_that_does_not_count_signs_in_again_and_again(world: TowerWorld) -> None:
    bert = await new_owner(world, await world.add_user("Bert"), counts=False, is_synced=True, edwards=True)
    browser = await world.client()
    for _ in range(3):
        assert (await signs_in(browser, bert.authenticator)).status_code == 200
    assert (await bert.client.get(PASSKEYS)).json()[0]["synced"] is True


async def test_nobody_learns_from_the_door_who_exists(world: TowerWorld, anna: Owner) -> None:
    """What is asked for names nobody, and takes no name."""
    fields = [set(await asked(await world.client())) for _ in range(2)]
    assert fields[0] == fields[1]
    stranger = new_authenticator()
    stranger.make(CREATION)
    unknown = await signs_in(await world.client(), stranger)
    known = await signs_in(await world.client(), anna.authenticator, tamper=True)
    assert_problem(unknown, 401, "passkey-refused")
    assert unknown.json() == known.json()


async def test_who_is_disabled_or_has_a_password_of_an_admin_does_not_come_in_by_a_passkey(
    world: TowerWorld, anna: Owner, root: httpx.AsyncClient
) -> None:
    user = f"/api/v1/users/{anna.person.id}"
    browser = await world.client()
    assert (await root.patch(user, json={"disabled": True})).status_code == 200
    assert_problem(await signs_in(browser, anna.authenticator), 401, "passkey-refused")
    assert await refusals(root) == ["passkey: disabled"]
    await root.patch(user, json={"disabled": False})
    assert (await signs_in(browser, anna.authenticator)).status_code == 200
    # After a reset nothing signs in by itself that was there before: the new password is needed, and the passkey too.
    await root.patch(user, json={"password": "a password by the admin"})
    assert_problem(await signs_in(browser, anna.authenticator), 401, "password-needed")
    options = await asked(browser)
    body = {"name": "Anna", "password": "a password by the admin", "passkey": anna.authenticator.get(options)}
    answer = await browser.post(SESSION, json=body)
    assert answer.json()["must_change_password"] is True


async def test_beside_a_password_the_passkey_is_the_second_factor(
    world: TowerWorld, anna: Owner, root: httpx.AsyncClient
) -> None:
    needed = assert_problem(await with_password(world), 401, "second-factor-needed")
    assert needed["kinds"] == ["passkey"]
    assert_problem(await with_password(world, password="wrong"), 401, "wrong-sign-in")
    browser = await world.client()

    async def sends(passkey: dict[str, Any], password: str = PASSWORD) -> httpx.Response:
        return await browser.post(SESSION, json={"name": "Anna", "password": password, "passkey": passkey})

    world.clock.advance(1000)  # what was tried before counts no more
    assert_problem(await sends(anna.authenticator.get(await asked(browser)), "wrong"), 401, "wrong-sign-in")
    bert = await new_owner(world, await world.add_user("Bert"))
    assert_problem(await sends(bert.authenticator.get(await asked(browser))), 401, "passkey-refused")
    assert (await refusals(root))[0] == "passkey: of another user"
    assert_problem(await sends(anna.authenticator.get(await asked(browser), tamper=True)), 401, "passkey-refused")
    answer = await sends(anna.authenticator.get(await asked(browser)))
    assert answer.status_code == 200, answer.text
    assert (await browser.get(ME)).json()["name"] == "Anna"


async def test_recovery_codes_come_with_the_first_factor_and_go_with_the_last(world: TowerWorld, anna: Owner) -> None:
    assert len(set(anna.recovery_codes)) == 10
    assert (await with_password(world, code=anna.recovery_codes[0])).status_code == 200
    assert_problem(await with_password(world, code=anna.recovery_codes[0]), 401, "wrong-code")
    assert_problem(await with_password(world, code="000000"), 401, "wrong-code")
    # A second factor of the other kind makes none anew, and without the passkeys it keeps those that there are.
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
    """By nobody: it would sign in as whoever added it last."""
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
    # What was asked of one session proves nothing in another, nor does an answer that signs in.
    options = await asked(anna.client, f"{PROOF}/passkey")
    stolen = {"kind": "passkey", "credential": anna.authenticator.get(options)}
    assert_problem(await other.post(PROOF, json=stolen), 409, "challenge-over")
    at_the_door = {"kind": "passkey", "credential": anna.authenticator.get(await asked(anna.client))}
    assert_problem(await anna.client.post(PROOF, json=at_the_door), 409, "challenge-over")
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
    # A new factor voids the proofs of the person's other sessions.
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
    for _ in range(100):  # and the throttle of passwords is full for this address and name
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
        # On the machine itself, by its name: for development.
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
