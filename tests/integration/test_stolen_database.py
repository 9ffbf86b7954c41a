"""What an attacker can do with a stolen copy of the database, and how the tower keeps its own key."""

import base64
import contextlib
from collections.abc import AsyncIterator, Iterator
from hashlib import sha256
from pathlib import Path

import pyotp
import pytest
from identity_world import _agent, public_half_of, record, signed_in
from sqlalchemy import text
from tower_world import PASSWORD, NewDrone, TowerWorld, start_tower

from server.accounts.core.totp import hash_recovery_code
from server.accounts.store.users import get_user
from server.fleet.store.tower_identity import TowerIdentity, check_key_is_there, forget_identity
from server.http.authentication import COOKIE
from server.kernel.people import Role
from server.link.api import agent_sign_in
from server.runtime.vault import Vault, VaultError, new_key
from server.storage.tables import METADATA
from wire.drone_key import DroneKey, enrolment_statement, key_text
from wire.ids import DroneId


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def hawk(world: TowerWorld) -> NewDrone:
    return await world.add_drone("hawk")


# -- a stolen database ---------------------------------------------------------------------------------------------


async def test_a_stolen_copy_of_the_database_signs_in_as_no_drone_and_makes_no_tower(
    world: TowerWorld, hawk: NewDrone
) -> None:
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    kite = await world.add_drone("kite")
    await world.give_credential(kite)
    crow = await world.add_drone("crow")
    for drone in (hawk, crow):
        await root.post(f"/api/v1/drones/{drone.id}/enrolments", json={})
    async with signed_in(world, hawk.identity):
        pass
    texts = await _texts(world)
    assert {key_text(hawk.key.public), key_text(world.tower.sign_in_rules.identity.public_key)} <= texts
    ids = [hawk.id, kite.id, crow.id]
    seeds = set(_seeds(texts))
    assert len(seeds) > 8
    # As a key: every 32 bytes in it, and the hash of every value.
    hub, rules = world.tower.hub, world.tower.sign_in_rules
    for seed in seeds:
        assert public_half_of(seed) not in {record(world, one).public_key for one in (hawk, kite, crow)}
        assert public_half_of(seed) != rules.identity.public_key
    for drone_id in ids:
        for seed in list(seeds)[:40]:
            sign_in = agent_sign_in.KeySignIn(hub, rules, None)
            hello = _agent(sign_in.challenge, DroneKey(DroneId(drone_id), seed)).hello()
            with pytest.raises(agent_sign_in.AgentRefused):
                await sign_in.check(hello, "")
    # As a bearer credential, a ticket, or an enrolment token: unchanged, and in the form of each.
    companion = await world.client()
    for one in sorted(each for each in texts if len(each) >= 16):
        shown = [one, *(f"twd_{drone_id}_{one[:43]}" for drone_id in ids), f"twl_00000001_{one[:43]}"]
        for bearer in shown:
            if bearer.isprintable() and bearer.isascii():
                answer = await companion.put(
                    "/api/v1/agent/files/1", content=b"", headers={"Authorization": f"Bearer {bearer}"}
                )
                assert answer.status_code == 401, bearer
        for token in (one, f"twe_{one}"):
            key = DroneKey(DroneId(1), b"x" * 32)
            body = {"token": token[:200], **_signed(token[:200], key)}
            assert (await companion.post("/api/v1/enrol", json=body)).status_code == 403, token


async def test_a_stolen_copy_of_the_database_signs_in_as_no_person(world: TowerWorld) -> None:
    root_person = await world.add_user("Root", Role.ADMIN)
    root = await world.signed_in(root_person)
    made = await root.post("/api/v1/tokens", json={"name": "script", "scopes": ["watch", "fly", "admin"]})
    seed = (await root.post("/api/v1/me/second-factor")).json()["secret"]
    code = {"code": pyotp.TOTP(seed).at(world.clock())}
    confirmed = await root.post("/api/v1/me/second-factor/confirm", json=code)
    codes = confirmed.json()["recovery_codes"]
    texts = await _texts(world)
    secrets = [root.cookies[COOKIE], made.json()["secret"], seed, PASSWORD, *codes]
    assert len(secrets) == 14
    assert not [one for one in texts for secret in secrets if secret in one]
    async with world.database.reading() as session:
        row = await get_user(session, root_person.id)
    thief = await world.client()
    for one in sorted(texts):
        assert hash_recovery_code(one) not in texts
        assert not await world.tower.passwords.verify(one, row.password_hash)
        if one.isprintable() and one.isascii() and not set(one) & set(' ",;\\'):
            for shown in (
                {"Cookie": f"{COOKIE}={one}"},
                {"Authorization": f"Bearer {one}"},
                {"Authorization": f"Bearer twt_{one}"},
            ):
                assert (await thief.get("/api/v1/me", headers=shown)).status_code == 401, one


async def _texts(world: TowerWorld) -> set[str]:
    """Every text and every binary value of the database, these in hexadecimal digits."""
    async with world.database.reading() as session:
        found = {
            value
            for table in METADATA.sorted_tables
            for row in await session.execute(text(f"SELECT * FROM {table.name}"))
            for value in row
            if isinstance(value, (str, bytes)) and value
        }
    return {one if isinstance(one, str) else one.hex() for one in found}


def _signed(token: str, key: DroneKey) -> dict[str, str]:
    signature = base64.urlsafe_b64encode(key.sign(enrolment_statement(token, key.public))).decode().rstrip("=")
    return {"public_key": key_text(key.public), "signature": signature}


def _seeds(texts: set[str]) -> Iterator[bytes]:
    for one in texts:
        yield sha256(one.encode()).digest()
        for decode in (bytes.fromhex, lambda t: base64.urlsafe_b64decode(t + "=="), lambda t: base64.b64decode(t)):
            with contextlib.suppress(ValueError):
                raw = decode(one)  # type: ignore[no-untyped-call]
                yield from (raw[at : at + 32] for at in range(max(1, len(raw) - 31)) if len(raw[at : at + 32]) == 32)


async def test_the_towers_key_outlives_it_and_is_sealed(world: TowerWorld, tmp_path: Path) -> None:
    first = world.tower.sign_in_rules.identity.public_key
    again = TowerIdentity()
    await again.load(world.tower.vault, world.database)
    assert again.public_key == first
    lost = Vault(key_file=tmp_path / "nothing")
    with pytest.raises(VaultError, match=r"the tower's identity is sealed and the key is missing.*forget-identity"):
        await check_key_is_there(lost, world.database)
    wrong = Vault(keys=[new_key()], key_file=tmp_path / "nothing")
    with pytest.raises(VaultError, match=r"the tower's identity: .* cannot be opened"):
        await TowerIdentity().load(wrong, world.database)
    newest = new_key()
    old_key = (world.settings.var / "secret.key").read_text().strip()
    await TowerIdentity().load(Vault(keys=[newest, old_key], key_file=tmp_path / "nothing"), world.database)
    renewed = TowerIdentity()
    await renewed.load(Vault(keys=[newest], key_file=tmp_path / "nothing"), world.database)
    assert renewed.public_key == first, "sealed again by the newest key, as the second factors are"
    async with world.database.writing() as session:
        await forget_identity(session)
    await renewed.load(world.tower.vault, world.database)
    assert renewed.public_key != first
