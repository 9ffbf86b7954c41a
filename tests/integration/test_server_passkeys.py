"""Passkey sign-in over real sockets: challenges, counters, refusals and the second factor."""

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import audit
from passkey_sign_in import CREATION, ME, SESSION, refusals, with_password
from passkey_world import (
    PARTY_ID,
    PASSKEYS,
    PUBLIC_URL,
    SIGN_IN,
    Owner,
    asked,
    new_authenticator,
    new_owner,
    signs_in,
)
from tower_world import PASSWORD, TowerWorld, assert_problem, start_tower
from worlds.soft_authenticator import b64, unb64

from server.accounts.core.challenges import LIFETIME_S
from server.kernel.people import Role


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
    # It ends like any session, and does not replace another one.
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
    # An intercepted response is useless in another browser, and then in any.
    assert_problem(await other.post(SIGN_IN, json={"credential": answer}), 409, "challenge-over")
    assert_problem(await browser.post(SIGN_IN, json={"credential": answer}), 409, "challenge-over")
    answer = anna.authenticator.get(await asked(browser))
    assert (await browser.post(SIGN_IN, json={"credential": answer})).status_code == 200
    assert_problem(await browser.post(SIGN_IN, json={"credential": answer}), 409, "challenge-over")
    made_up = anna.authenticator.get(await asked(browser), challenge=b64(bytes(32)))
    assert_problem(await browser.post(SIGN_IN, json={"credential": made_up}), 409, "challenge-over")
    # A response to a challenge for adding a passkey does not sign in.
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
    """The options name no user, and the request takes no name."""
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
    # After a reset, no earlier credential signs in alone: it takes the new password and the passkey.
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

    world.clock.advance(1000)  # earlier tries no longer count
    assert_problem(await sends(anna.authenticator.get(await asked(browser)), "wrong"), 401, "wrong-sign-in")
    bert = await new_owner(world, await world.add_user("Bert"))
    assert_problem(await sends(bert.authenticator.get(await asked(browser))), 401, "passkey-refused")
    assert (await refusals(root))[0] == "passkey: of another user"
    assert_problem(await sends(anna.authenticator.get(await asked(browser), tamper=True)), 401, "passkey-refused")
    answer = await sends(anna.authenticator.get(await asked(browser)))
    assert answer.status_code == 200, answer.text
    assert (await browser.get(ME)).json()["name"] == "Anna"
