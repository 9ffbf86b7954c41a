"""Exchange of a bearer credential for a key, with every interruption."""

import asyncio
import json
from collections.abc import AsyncIterator
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest
from agent_fakes import CREDENTIAL, DRONE, running_tower, until
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from identity_world import _agent, channel, record, refused, signed_in, url
from tower_world import NewDrone, TowerWorld, start_tower
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
from websockets.typing import Subprotocol

from onboard_agent.link.identity import Identity, Kept
from onboard_agent.link.identity_file import read_identity, write_private
from onboard_agent.link.tower_url import parse_tower_url
from onboard_agent.sockets.control_channel import CredentialRefused, open_channel
from server.kernel.people import Role
from wire.control_messages import (
    AGENT_SUBPROTOCOL,
    Hello,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.credential import Credential
from wire.drone_key import DroneKey
from wire.ids import DroneId
from wire.key_agreement import public_bytes
from wire.sign_in import SignInPurpose


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def hawk(world: TowerWorld) -> NewDrone:
    return await world.add_drone("hawk")


# -- the exchange of a credential ------------------------------------------------------------------------------------


@pytest.fixture
async def credential(world: TowerWorld, hawk: NewDrone) -> Credential:
    return await world.give_credential(hawk)


@pytest.fixture
def file(tmp_path: Path, credential: Credential) -> Path:
    """A credential file as an older agent writes it."""
    path = tmp_path / "token"
    path.write_text(f"{credential}\n")
    return path


async def assert_exchanged(world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential) -> None:
    """Asserts the end state: only the key signs in, and nothing of the credential is left."""
    async with signed_in(world, read_identity(file)):
        pass
    identity = read_identity(file)
    assert identity.key is not None
    assert identity.credential is None
    assert credential.secret.encode() not in await asyncio.to_thread(file.read_bytes)
    assert record(world, hawk).identity == ("", identity.key.public)
    with pytest.raises(InvalidStatus):
        async with channel(world, str(credential)):
            pass


async def test_a_credential_signs_in_once_and_is_exchanged_for_a_key(
    world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential
) -> None:
    identity = read_identity(file)
    async with signed_in(world, identity) as opened:
        assert opened.welcome.credential_forgotten
        drone = world.tower.hub.state.drones.get(DroneId(hawk.id))
        assert drone is not None and drone.link is not None and drone.link.link_id == opened.sealed.link_id
    assert identity.credential is None
    await assert_exchanged(world, hawk, file, credential)
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    trail = (await root.get("/api/v1/audit")).json()
    assert [one["action"] for one in trail].count("drone.credential_exchanged") == 1


async def test_an_agent_that_was_killed_before_the_tower_heard_of_its_key(
    world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential
) -> None:
    made = read_identity(file).make_key()
    assert record(world, hawk).identity == (credential.hashed(), b"")
    await assert_exchanged(world, hawk, file, credential)
    assert read_identity(file).key == made


async def test_an_answer_that_was_lost_or_an_agent_killed_before_it_wrote_that_down(
    world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*_: object) -> None:
        raise asyncio.CancelledError

    with monkeypatch.context() as patched:
        patched.setattr(Identity, "welcomed", killed)
        with pytest.raises(asyncio.CancelledError):
            await open_channel(url(world), read_identity(file))
    left = read_identity(file)
    assert left.credential == credential, "it had no word yet that it may forget it"
    assert record(world, hawk).identity == ("", left.key.public if left.key else b"")
    await assert_exchanged(world, hawk, file, credential)


async def test_a_tower_that_was_killed_before_it_wrote_the_key_down(
    world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also covers an unreachable database: the drone still gets its link, by its credential."""

    async def out_of_reach(*_: object, **__: object) -> bool:
        raise OSError("no database")

    with monkeypatch.context() as patched:
        patched.setattr("server.fleet.store.exchange.exchange_credential", out_of_reach)
        async with signed_in(world, read_identity(file)) as opened:
            assert not opened.welcome.credential_forgotten
    assert read_identity(file).credential == credential
    assert record(world, hawk).identity == (credential.hashed(), b"")
    await assert_exchanged(world, hawk, file, credential)


async def test_a_tower_that_was_killed_after_it_wrote_the_key_down(
    world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tower's live state lacks the key; it reads the key from the database, as at a start."""

    async def killed() -> None:
        raise OSError("no database")

    with monkeypatch.context() as patched:
        patched.setattr(world.tower.roster, "refresh", killed)
        async with signed_in(world, read_identity(file)) as opened:
            assert not opened.welcome.credential_forgotten
    await world.tower.roster.refresh()
    left = read_identity(file)
    assert left.credential == credential
    assert record(world, hawk).identity == ("", left.key.public if left.key else b"")
    await assert_exchanged(world, hawk, file, credential)


async def test_a_file_that_cannot_be_written_leaves_everything_as_it_was(
    world: TowerWorld, hawk: NewDrone, credential: Credential
) -> None:
    identity = Identity(Kept(credential.drone_id, None, credential))
    for _ in range(2):
        async with signed_in(world, identity) as opened:
            assert not opened.welcome.credential_forgotten
    assert record(world, hawk).identity == (credential.hashed(), b"")


async def test_of_two_who_show_the_same_credential_the_first_is_the_drone(
    world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential, tmp_path: Path
) -> None:
    copied = tmp_path / "copied"
    write_private(copied, f"{credential}\n")
    async with channel(world, str(credential)) as late:
        challenge = decode_to_agent(str(await late.recv()))
        async with signed_in(world, read_identity(file)):
            pass
        thief = _agent(challenge, DroneKey(DroneId(hawk.id), b"t" * 32))
        thief._transcript = replace(thief._transcript, purpose=SignInPurpose.EXCHANGE)
        await late.send(encode_message(thief.hello()))
        assert "unknown credential" in await refused(late)
    with pytest.raises(CredentialRefused):
        await open_channel(url(world), read_identity(copied))
    await assert_exchanged(world, hawk, file, credential)


async def test_an_agent_of_an_older_version_still_links_until_a_day(
    world: TowerWorld, hawk: NewDrone, credential: Credential
) -> None:
    async def old_agent() -> Welcome:
        async with connect(
            world.agent_url,
            subprotocols=[Subprotocol(AGENT_SUBPROTOCOL)],
            additional_headers={"Authorization": f"Bearer {credential}"},
            proxy=None,
        ) as opened:
            hello = Hello(agent_version="0.0.9", public_key=public_bytes(X25519PrivateKey.generate()))
            await opened.send(json.dumps({**json.loads(encode_message(hello)), "sign_in": None}))
            reported = decode_to_agent(str(await opened.recv()))
            assert isinstance(reported, Welcome)
            return reported

    assert (await old_agent()).signature == b""
    assert record(world, hawk).identity == (credential.hashed(), b"")
    until_now = replace(world.tower.sign_in_rules, credentials_until=world.clock())
    object.__setattr__(world.tower, "sign_in_rules", until_now)
    with pytest.raises(InvalidStatus) as turned_away:
        await old_agent()
    assert turned_away.value.response.status_code == 401
    assert b"enrol the drone again" in turned_away.value.response.body
    with pytest.raises(CredentialRefused):
        await open_channel(url(world), Identity(Kept(credential.drone_id, None, credential), lambda _: None))
    later = replace(until_now, credentials_until=world.clock() + timedelta(hours=1))
    object.__setattr__(world.tower, "sign_in_rules", later)
    await old_agent()


async def test_a_tower_of_an_older_version_is_linked_with_by_the_credential_which_is_kept() -> None:
    kept: list[Kept] = []
    async with running_tower() as tower:
        await tower.die()
        tower.is_old = True
        await tower.start()
        identity = Identity(Kept(DRONE, None, CREDENTIAL), kept.append)
        address = parse_tower_url(f"http://127.0.0.1:{tower.port}")
        for _ in range(2):  # the second time there is also a key, which that tower does not know
            opened = await open_channel(address, identity)
            await until(lambda: tower.sealed is not None)
            assert tower.sealed is not None
            tower.sealed.receive(opened.sealed.seal_urgent(b"x"), 10.0)
            await opened.connection.close()
        assert identity.credential == CREDENTIAL
        with pytest.raises(CredentialRefused, match="knows nothing of drones' keys"):
            await open_channel(address, Identity(Kept(DRONE, identity.key)))
