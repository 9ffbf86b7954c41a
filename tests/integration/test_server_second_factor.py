"""A second factor over real sockets: begun, confirmed, asked for, used once, renewed, removed, taken away."""

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pyotp
import pytest
from control_world import audit
from sqlalchemy import select
from tower_world import PASSWORD, Person, TowerWorld, assert_problem, start_tower

from server.accounts.tables import RecoveryCodeRow, Role

FACTOR = "/api/v1/me/second-factor"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


class Authenticator:
    """A telephone whose clock is the tower's."""

    def __init__(self, world: TowerWorld, secret: str) -> None:
        self._world = world
        self._totp = pyotp.TOTP(secret)

    def code(self) -> str:
        """A new one: half a minute later than the last."""
        self._world.clock.advance(30)
        return self._totp.at(self._world.clock())


async def enrolled(world: TowerWorld, person: Person) -> tuple[httpx.AsyncClient, Authenticator, list[str]]:
    client = await world.signed_in(person)
    begun = (await client.post(FACTOR, json={"password": PASSWORD})).json()
    assert begun["secret"] in begun["uri"]
    assert begun["qr_svg"].startswith("<svg")
    telephone = Authenticator(world, begun["secret"])
    confirmed = await client.post(f"{FACTOR}/confirm", json={"code": telephone.code()})
    assert confirmed.status_code == 200, confirmed.text
    return client, telephone, confirmed.json()["recovery_codes"]


async def sign_in(world: TowerWorld, code: str | None = None, password: str = PASSWORD) -> httpx.Response:
    body = {"name": "Anna", "password": password} | ({"code": code} if code is not None else {})
    return await (await world.client()).post("/api/v1/session", json=body)


async def test_the_code_is_asked_for_and_is_worth_one_use(world: TowerWorld, anna: Person) -> None:
    _, telephone, _ = await enrolled(world, anna)
    assert_problem(await sign_in(world), 401, "second-factor-needed")
    assert_problem(await sign_in(world, password="wrong"), 401, "wrong-sign-in")
    code = telephone.code()
    assert_problem(await sign_in(world, code, password="wrong"), 401, "wrong-sign-in")
    answer = await sign_in(world, code)
    assert answer.status_code == 200, answer.text
    assert answer.json()["second_factor"] is True
    assert_problem(await sign_in(world, code), 401, "wrong-code")
    assert_problem(await sign_in(world, "000000"), 401, "wrong-code")
    assert (await sign_in(world, telephone.code())).status_code == 200


async def test_recovery_codes_are_hashed_and_worth_one_use_each(world: TowerWorld, anna: Person) -> None:
    client, telephone, codes = await enrolled(world, anna)
    assert len(set(codes)) == 10
    async with world.database.reading() as session:
        kept = list(await session.scalars(select(RecoveryCodeRow)))
    assert len(kept) == 10
    assert not any(code in str(vars(row)) for code in codes for row in kept)
    assert (await sign_in(world, codes[3].upper())).status_code == 200
    assert_problem(await sign_in(world, codes[3]), 401, "wrong-code")
    assert (await client.get(FACTOR)).json() == {"enabled": True, "recovery_codes_left": 9}
    renewed = await client.post(f"{FACTOR}/recovery-codes", json={"password": PASSWORD, "code": telephone.code()})
    assert_problem(await sign_in(world, codes[4]), 401, "wrong-code")
    assert (await sign_in(world, renewed.json()["recovery_codes"][0])).status_code == 200


async def test_nothing_changes_before_it_is_confirmed(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    assert_problem(await client.post(FACTOR, json={"password": "wrong"}), 403, "wrong-password")
    assert_problem(await client.post(f"{FACTOR}/confirm", json={"code": "123456"}), 409, "no-second-factor-begun")
    await client.post(FACTOR, json={"password": PASSWORD})
    assert_problem(await client.post(f"{FACTOR}/confirm", json={"code": "none"}), 403, "code-refused")
    assert (await client.get(FACTOR)).json() == {"enabled": False, "recovery_codes_left": 0}
    assert (await sign_in(world)).status_code == 200


async def test_it_is_removed_with_password_and_code_only(world: TowerWorld, anna: Person) -> None:
    client, telephone, _ = await enrolled(world, anna)
    assert_problem(await client.post(FACTOR, json={"password": PASSWORD}), 409, "second-factor-on")
    remove = f"{FACTOR}/remove"
    assert_problem(
        await client.post(remove, json={"password": "wrong", "code": telephone.code()}), 403, "wrong-password"
    )
    assert_problem(await client.post(remove, json={"password": PASSWORD, "code": "000000"}), 403, "code-refused")
    assert (await client.post(remove, json={"password": PASSWORD, "code": telephone.code()})).status_code == 204
    assert (await sign_in(world)).status_code == 200


async def test_an_admin_takes_it_from_who_has_lost_it(world: TowerWorld, anna: Person) -> None:
    await enrolled(world, anna)
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    assert (await root.get(f"/api/v1/users/{anna.id}")).json()["second_factor"] is True
    answer = await root.delete(f"/api/v1/users/{anna.id}/second-factor")
    assert answer.json()["second_factor"] is False
    assert (await sign_in(world)).status_code == 200
    actions = [one["action"] for one in await audit(root, "user.second")]
    assert actions == ["user.second_factor_off", "user.second_factor_on"]


async def test_a_try_without_the_code_counts_like_a_wrong_password(world: TowerWorld, anna: Person) -> None:
    await enrolled(world, anna)
    slugs = [(await sign_in(world)).json()["type"] for _ in range(7)]
    assert slugs == ["/problems/second-factor-needed"] * 5 + ["/problems/too-many-tries"] * 2
