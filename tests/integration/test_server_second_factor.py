"""A second factor over real sockets: set up, confirmed, required, used once, renewed, removed, reset."""

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pyotp
import pytest
from control_world import audit
from sqlalchemy import select, update
from tower_world import PASSWORD, Person, TowerWorld, assert_problem, start_tower

from server.accounts.store.tables import RecoveryCodeRow, UserRow
from server.fleet.store.tower_identity import forget_identity
from server.kernel.people import Role
from server.runtime.vault import VaultError, new_key
from server.storage.database import open_database

FACTOR = "/api/v1/me/second-factor"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


class Authenticator:
    """An authenticator app whose clock is the tower's."""

    def __init__(self, world: TowerWorld, secret: str) -> None:
        self._world = world
        self._totp = pyotp.TOTP(secret)

    def code(self) -> str:
        """Returns a new code: half a minute later than the last."""
        self._world.clock.advance(30)
        return self._totp.at(self._world.clock())


async def enrolled(world: TowerWorld, person: Person) -> tuple[httpx.AsyncClient, Authenticator, list[str]]:
    client = await world.signed_in(person)
    begun = (await client.post(FACTOR)).json()
    assert begun["secret"] in begun["uri"]
    assert begun["qr_svg"].startswith("<svg")
    telephone = Authenticator(world, begun["secret"])
    confirmed = await client.post(f"{FACTOR}/confirm", json={"code": telephone.code()})
    assert confirmed.status_code == 200, confirmed.text
    return client, telephone, confirmed.json()["recovery_codes"]


async def prove(client: httpx.AsyncClient, telephone: Authenticator) -> None:
    """Proves the user, so that this browser may change credentials for five minutes."""
    body = {"password": PASSWORD, "code": telephone.code()}
    answer = await client.post("/api/v1/session/proof", json=body)
    assert answer.status_code == 200, answer.text


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
    assert (await client.get(FACTOR)).json() == {"enabled": True, "passkeys": 0, "recovery_codes_left": 9}
    await prove(client, telephone)
    renewed = await client.post(f"{FACTOR}/recovery-codes")
    assert_problem(await sign_in(world, codes[4]), 401, "wrong-code")
    assert (await sign_in(world, renewed.json()["recovery_codes"][0])).status_code == 200


async def test_nothing_changes_before_it_is_confirmed(world: TowerWorld, anna: Person) -> None:
    client = await world.signed_in(anna)
    assert_problem(await client.post(f"{FACTOR}/confirm", json={"code": "123456"}), 409, "no-second-factor-begun")
    await client.post(FACTOR)
    assert_problem(await client.post(f"{FACTOR}/confirm", json={"code": "none"}), 403, "code-refused")
    assert (await client.get(FACTOR)).json() == {"enabled": False, "passkeys": 0, "recovery_codes_left": 0}
    assert (await sign_in(world)).status_code == 200


async def test_it_is_removed_with_a_fresh_proof_only(world: TowerWorld, anna: Person) -> None:
    client, telephone, _ = await enrolled(world, anna)
    assert_problem(await client.post(FACTOR), 409, "second-factor-on")
    world.clock.advance(300)
    assert_problem(await client.post(f"{FACTOR}/remove"), 403, "proof-needed")
    wrong = {"password": "wrong", "code": telephone.code()}
    assert_problem(await client.post("/api/v1/session/proof", json=wrong), 403, "wrong-password")
    wrong = {"password": PASSWORD, "code": "000000"}
    assert_problem(await client.post("/api/v1/session/proof", json=wrong), 403, "code-refused")
    assert_problem(await client.post("/api/v1/session/proof", json={"password": PASSWORD}), 403, "code-needed")
    assert_problem(await client.post(f"{FACTOR}/remove"), 403, "proof-needed")
    await prove(client, telephone)
    assert (await client.post(f"{FACTOR}/remove")).status_code == 204
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
    world.clock.stop()
    slugs = [(await sign_in(world)).json()["type"] for _ in range(7)]
    assert slugs == ["/problems/second-factor-needed"] * 5 + ["/problems/too-many-tries"] * 2


async def test_the_database_holds_it_sealed_and_a_new_key_seals_it_anew(tmp_path: Path) -> None:
    old, new = new_key(), new_key()
    sealed = []
    secret = ""
    for number, keys in enumerate((old, f"{new},{old}", new)):
        async with start_tower(tmp_path, secret_keys=keys) as world:
            if number == 0:
                client = await world.signed_in(await world.add_user("Anna"))
                secret = (await client.post(FACTOR)).json()["secret"]
                code = pyotp.TOTP(secret).at(world.clock())
                assert (await client.post(f"{FACTOR}/confirm", json={"code": code})).status_code == 200
            world.clock.advance(60.0 * (number + 1))
            answer = await sign_in(world, pyotp.TOTP(secret).at(world.clock()))
            assert answer.status_code == 200, answer.text
            async with world.database.reading() as session:
                row = (await session.scalars(select(UserRow))).one()
            sealed.append(row.totp_sealed)
            assert secret not in str(vars(row))
    assert sealed[0] != sealed[1] == sealed[2]


async def test_without_its_key_the_tower_does_not_start_and_says_what_to_do(tmp_path: Path) -> None:
    key_file = tmp_path / "var" / "secret.key"
    async with start_tower(tmp_path) as world:
        await enrolled(world, await world.add_user("Anna"))
    kept = key_file.read_text()
    key_file.unlink()
    with pytest.raises(VaultError, match=r"identity is sealed and the key is missing.*tower forget-identity"):
        async with start_tower(tmp_path):
            raise AssertionError("it must not start")
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'var' / 'tower.sqlite3'}")
    async with database.writing() as session:
        await forget_identity(session)
    await database.close()
    with pytest.raises(VaultError, match=r"sealed \(Anna\).*key is missing.*TOWER_SECRET_KEYS.*second-factor-off"):
        async with start_tower(tmp_path):
            raise AssertionError("it must not start")
    assert not key_file.exists(), "a new key would hide that the old one is missing"
    with pytest.raises(VaultError, match=r"second factor of Anna.*cannot be opened"):
        async with start_tower(tmp_path, secret_keys=new_key()):
            raise AssertionError("it must not start")
    key_file.write_text(kept)
    async with start_tower(tmp_path) as world:
        assert_problem(await sign_in(world), 401, "second-factor-needed")


async def test_a_secret_moved_to_another_account_opens_nothing(world: TowerWorld, anna: Person) -> None:
    await enrolled(world, anna)
    ben = await world.add_user("Ben")
    async with world.database.writing() as session:
        theirs = await session.scalar(select(UserRow.totp_sealed).where(UserRow.id == anna.id))
        await session.execute(update(UserRow).where(UserRow.id == ben.id).values(totp_sealed=theirs))
    body = {"name": "Ben", "password": PASSWORD, "code": "123456"}
    answer = await (await world.client()).post("/api/v1/session", json=body)
    assert_problem(answer, 500, "internal-error")
    assert "set-cookie" not in answer.headers
