"""A drone is known by its key: sign-in, what a thief can do, and the exchange of a bearer credential, step by step."""

import asyncio
import base64
import contextlib
import json
import secrets
import ssl
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from datetime import timedelta
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec
import pytest
from agent_fakes import CREDENTIAL, DRONE, running_tower, until
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from sqlalchemy import text
from tower_world import NewDrone, TowerWorld, start_tower
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Subprotocol

from bench.key_sign_in import key_sign_in
from bench.tls_front import TlsFront, make_certificate
from onboard_agent import cli
from onboard_agent.link import enrolment
from onboard_agent.link.enrolment import enrol
from onboard_agent.link.identity import Identity, Kept
from onboard_agent.link.identity_file import read_identity, write_private
from onboard_agent.link.signing_in import KeySignIn
from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.sockets import control_channel
from onboard_agent.sockets.control_channel import CredentialRefused, NoLink, OpenedChannel, open_channel, try_sign_in
from onboard_agent.unusable import Unusable
from server.api.relay import agent_sign_in
from server.api.relay.tls_binding import TlsBinding
from server.domain.people import Role
from server.runtime.vault import Vault, VaultError, new_key
from server.store.fleet.tower_identity import TowerIdentity, check_key_is_there, forget_identity
from server.store.tables import METADATA
from wire.channel_binding import end_point
from wire.control_messages import (
    AGENT_SUBPROTOCOL,
    KEY_SUBPROTOCOL,
    Hello,
    ResumeChallenge,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.credential import Credential
from wire.drone_key import DroneKey, enrolment_statement, key_text, public_half
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


def url(world: TowerWorld) -> TowerUrl:
    return parse_tower_url(world.base_url)


def record(world: TowerWorld, drone: NewDrone) -> Any:
    found = world.tower.hub.drone(DroneId(drone.id))
    assert found is not None
    return found.record


@contextlib.asynccontextmanager
async def signed_in(world: TowerWorld, identity: Identity) -> AsyncIterator[OpenedChannel]:
    opened = await _on_a_busy_machine(world, identity)
    try:
        yield opened
    finally:
        await opened.connection.close()


async def _on_a_busy_machine(world: TowerWorld, identity: Identity) -> OpenedChannel:
    """An agent gives up an upgrade after 5 s, before it has said anything, and tries again."""
    for _ in range(5):
        try:
            return await open_channel(url(world), identity)
        except NoLink as error:
            if "does not answer the upgrade" not in str(error):
                raise
    raise AssertionError("the tower never answered")


@contextlib.asynccontextmanager
async def channel(world: TowerWorld, credential: str = "") -> AsyncIterator[ClientConnection]:
    async with connect(
        world.agent_url,
        subprotocols=[Subprotocol(KEY_SUBPROTOCOL)],
        additional_headers={"Authorization": f"Bearer {credential}"} if credential else None,
        proxy=None,
    ) as opened:
        yield opened


async def refused(opened: ClientConnection) -> str:
    """Why the tower ends it."""
    with pytest.raises(ConnectionClosed):
        await asyncio.wait_for(opened.recv(), 10)
    assert opened.close_code == 4401, opened.close_reason
    return str(opened.close_reason)


# -- signing in ----------------------------------------------------------------------------------------------------


async def test_a_drone_signs_in_by_its_key_and_learns_which_tower_is_its_own(world: TowerWorld, hawk: NewDrone) -> None:
    identity = Identity(Kept(hawk.key.drone_id, hawk.key), lambda _: None)
    async with signed_in(world, identity) as opened:
        drone = world.tower.hub.drone(DroneId(hawk.id))
        assert drone is not None and drone.link is not None
        assert drone.link.resume_key == opened.resume_key
        assert drone.link.ticket == opened.welcome.ticket != ""
        assert identity.tower_key == world.tower.sign_in_rules.identity.public_key
        # A trial takes no link from an agent that flies.
        assert await try_sign_in(url(world), identity) == "the drone's key"
        assert drone.link.link_id == opened.welcome.link_id
    stranger = Identity(Kept(hawk.key.drone_id, hawk.key, tower_key=b"T" * 32))
    with pytest.raises(NoLink, match="is not the tower that enrolled this drone"):
        await open_channel(url(world), stranger)


async def test_a_signature_is_worth_nothing_a_second_time_nor_with_anything_else_in_its_place(
    world: TowerWorld, hawk: NewDrone
) -> None:
    """Replayed, moved to another challenge, and with each thing changed that the hello says."""
    kite = await world.add_drone("kite")
    async with channel(world) as first:
        said = (await key_sign_in(first, hawk.key)).hello()
        assert said.sign_in is not None
        await first.send(encode_message(said))
        assert isinstance(decode_to_agent(str(await first.recv())), Welcome)
        async with channel(world) as again:
            await again.recv()
            await again.send(encode_message(said))
            assert "key is not known" in await refused(again)
    changes: dict[str, dict[str, Any]] = {
        "another drone": {"drone_id": kite.id},
        "another tower": {"tower": "tower.example.org:443"},
        "another nonce": {"nonce": b"n" * 32},
        "a trial": {"purpose": 3},
        "another key": {"drone_key": kite.key.public},
        "another signature": {"signature": b"s" * 64},
        "another public key": {},
        "another link": {},
    }
    for what, change in changes.items():
        async with channel(world) as opened:
            hello = (await key_sign_in(opened, hawk.key)).hello()
            assert hello.sign_in is not None
            sign_in = _with(hello.sign_in, **change)
            public_key = b"\x09" + bytes(31) if what == "another public key" else hello.public_key
            resume = 5 if what == "another link" else None
            await opened.send(encode_message(_with(hello, sign_in=sign_in, public_key=public_key, resume=resume)))
            assert "key is not known" in await refused(opened), what
    async with channel(world) as opened:
        hello = (await key_sign_in(opened, hawk.key)).hello()
        await opened.send(encode_message(_with(hello, sign_in=_with(hello.sign_in, binding=b"b" * 32))))
        assert "another TLS certificate" in await refused(opened)


def _with(struct: Any, **changes: Any) -> Any:
    return msgspec.structs.replace(struct, **changes)


async def test_who_relays_to_another_tower_gets_nowhere(world: TowerWorld, hawk: NewDrone) -> None:
    """A tower of a thief's own shows the agent this tower's nonce, with the thief's identity or keys of the link."""
    thief = b"\x05" * 32
    for lie in ("tower_key", "public_key"):
        async with channel(world) as opened:
            challenge = decode_to_agent(str(await opened.recv()))
            shown = _with(challenge, **{lie: public_half_of(thief) if lie == "tower_key" else thief})
            sign_in = _agent(shown, hawk.key)
            await opened.send(encode_message(sign_in.hello()))
            assert "key is not known" in await refused(opened)


def public_half_of(seed: bytes) -> bytes:
    return public_half(Ed25519PrivateKey.from_private_bytes(seed))


def _agent(challenge: Any, key: DroneKey) -> Any:
    return KeySignIn(
        challenge,
        key=key,
        tower="127.0.0.1:1",
        tower_key=None,
        certificate=None,
        purpose=SignInPurpose.LINK,
        private_key=X25519PrivateKey.generate(),
        random_bytes=secrets.token_bytes,
    )


async def test_what_is_answered_and_done_does_not_tell_whether_there_is_such_a_drone(
    world: TowerWorld, hawk: NewDrone, monkeypatch: pytest.MonkeyPatch
) -> None:
    kite = await world.add_drone("kite")
    await world.give_credential(kite)  # it has no key
    checked: list[bytes] = []
    really = agent_sign_in.is_signed

    def counted(public_key: bytes, signature: bytes, message: bytes) -> bool:
        checked.append(public_key)
        return really(public_key, signature, message)

    monkeypatch.setattr(agent_sign_in, "is_signed", counted)
    words = set()
    for drone_id in (hawk.id, kite.id, 4711):
        async with channel(world) as opened:
            hello = (await key_sign_in(opened, DroneKey(DroneId(drone_id), b"w" * 32))).hello()
            await opened.send(encode_message(hello))
            words.add(await refused(opened))
    assert len(words) == 1
    assert len(checked) == 3, "one signature each"
    assert len({len(key) for key in checked}) == 1


@pytest.mark.parametrize("first", [Hello(agent_version="1", public_key=b"k" * 32), b"bytes", "nonsense"])
async def test_a_first_message_that_is_not_signed_ends_it(world: TowerWorld, first: Any) -> None:
    async with channel(world) as opened:
        await opened.recv()
        await opened.send(encode_message(first) if isinstance(first, Hello) else first)
        with pytest.raises(ConnectionClosed):
            await asyncio.wait_for(opened.recv(), 10)
        assert opened.close_code == 4400


async def test_revoking_ends_the_link_at_once_and_comes_before_whatever_is_still_asked(
    world: TowerWorld, hawk: NewDrone
) -> None:
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    async with signed_in(world, hawk.identity) as opened, channel(world) as another:
        drone = world.tower.hub.drone(DroneId(hawk.id))
        assert drone is not None and drone.link is not None
        link = drone.link
        # It has proven its key, and is asked for the link that it names, when the key is revoked.
        for datagram in opened.sealed.datagrams_to_send(0.0):
            world.tower.hub.datagram(datagram, link.link_id, ("127.0.0.1", 9), asyncio.get_running_loop().time())
        link.routes.follow(("127.0.0.1", 9))
        sign_in = await key_sign_in(another, hawk.key, resume=opened.sealed.link_id)
        await another.send(encode_message(sign_in.hello()))
        asked = decode_to_agent(str(await another.recv()))
        assert (await root.delete(f"/api/v1/drones/{hawk.id}/key")).status_code == 200
        assert drone.link is None
        with pytest.raises(ConnectionClosed):
            while True:
                await asyncio.wait_for(opened.connection.recv(), 10)
        assert opened.connection.close_code == 4401
        if isinstance(asked, ResumeChallenge):
            await another.send('{"type":"resume_proof","proof":""}')
            assert "revoked" in await refused(another)
    with pytest.raises(CredentialRefused, match="key is not known"):
        await open_channel(url(world), hawk.identity)


async def test_the_signature_is_bound_to_the_certificate_that_the_tower_was_told(
    world: TowerWorld, hawk: NewDrone, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody between has a certificate that the agent trusts as well, and hands on what both sides say."""
    folders = [tmp_path / name for name in ("ours", "thiefs")]
    for folder in folders:
        folder.mkdir()
    (ours, our_key), (theirs, their_key) = (make_certificate(folder, "127.0.0.1") for folder in folders)
    rules = replace(world.tower.sign_in_rules, binding=TlsBinding(ours))
    object.__setattr__(world.tower, "sign_in_rules", rules)
    for certificate, key, good in ((ours, our_key, True), (theirs, their_key, False)):
        front = TlsFront(int(world.base_url.rpartition(":")[2]))
        port = await front.open("127.0.0.1", certificate, key)
        trusting = ssl.create_default_context(cafile=str(certificate))
        monkeypatch.setattr(control_channel, "trust", lambda trusting=trusting: trusting)
        address = parse_tower_url(f"https://127.0.0.1:{port}")
        try:
            if good:
                await (await open_channel(address, hawk.identity)).connection.close()
            else:
                with pytest.raises(CredentialRefused, match="another TLS certificate"):
                    await open_channel(address, hawk.identity)
        finally:
            await front.close()
    with pytest.raises(NoLink, match="there is no TLS"):
        await open_channel(url(world), hawk.identity)
    # The proxy has a new certificate, and its file has been changed: both are believed.
    binding = TlsBinding(ours)
    assert binding.is_ours(_end_point(ours))
    ours.write_bytes(theirs.read_bytes())
    assert binding.is_ours(_end_point(theirs))
    assert not binding.is_ours(b"")


def _end_point(certificate: Path) -> bytes:
    return end_point(ssl.PEM_cert_to_DER_cert(certificate.read_text()))


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
    async with world.database.reading() as session:
        found = {
            value
            for table in METADATA.sorted_tables
            for row in await session.execute(text(f"SELECT * FROM {table.name}"))
            for value in row
            if isinstance(value, (str, bytes)) and value
        }
    texts = {one if isinstance(one, str) else one.hex() for one in found}
    assert {key_text(hawk.key.public), key_text(world.tower.sign_in_rules.identity.public_key)} <= texts
    ids = [hawk.id, kite.id, crow.id]
    seeds = set(_seeds(texts))
    assert len(seeds) > 8
    # As a key: every 32 bytes that are there, and the hash of everything that is.
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
    # As a bearer credential, a ticket, or an enrolment token, as it stands and in the form of each.
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
    assert renewed.public_key == first, "sealed anew by the newest key, as the second factors are"
    async with world.database.writing() as session:
        await forget_identity(session)
    await renewed.load(world.tower.vault, world.database)
    assert renewed.public_key != first


# -- the exchange of a credential ------------------------------------------------------------------------------------


@pytest.fixture
async def credential(world: TowerWorld, hawk: NewDrone) -> Credential:
    return await world.give_credential(hawk)


@pytest.fixture
def file(tmp_path: Path, credential: Credential) -> Path:
    """As the agent of an older version has it."""
    path = tmp_path / "token"
    path.write_text(f"{credential}\n")
    return path


async def assert_exchanged(world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential) -> None:
    """The end of it, however it came about: only the key signs in, and nothing of the credential is left."""
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
        drone = world.tower.hub.drone(DroneId(hawk.id))
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
    """Or whose database is out of reach: the drone has its link nevertheless, by its credential."""

    async def out_of_reach(*_: object, **__: object) -> bool:
        raise OSError("no database")

    with monkeypatch.context() as patched:
        patched.setattr("server.store.fleet.exchange.exchange_credential", out_of_reach)
        async with signed_in(world, read_identity(file)) as opened:
            assert not opened.welcome.credential_forgotten
    assert read_identity(file).credential == credential
    assert record(world, hawk).identity == (credential.hashed(), b"")
    await assert_exchanged(world, hawk, file, credential)


async def test_a_tower_that_was_killed_after_it_wrote_the_key_down(
    world: TowerWorld, hawk: NewDrone, file: Path, credential: Credential, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What its live picture does not know yet it learns from the database, as at a start."""

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
        assert "not known" in await refused(late)
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
            told = decode_to_agent(str(await opened.recv()))
            assert isinstance(told, Welcome)
            return told

    assert (await old_agent()).signature == b""
    assert record(world, hawk).identity == (credential.hashed(), b"")
    until_now = replace(world.tower.sign_in_rules, credentials_until=world.clock())
    object.__setattr__(world.tower, "sign_in_rules", until_now)
    with pytest.raises(InvalidStatus) as turned_away:
        await old_agent()
    assert turned_away.value.response.status_code == 401
    assert b"enrol the drone anew" in turned_away.value.response.body
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
        for _ in range(2):  # the second time there is a key besides, which that tower knows nothing of
            opened = await open_channel(address, identity)
            await until(lambda: tower.sealed is not None)
            assert tower.sealed is not None
            tower.sealed.receive(opened.sealed.seal_urgent(b"x"), 10.0)
            await opened.connection.close()
        assert identity.credential == CREDENTIAL
        with pytest.raises(CredentialRefused, match="knows nothing of drones' keys"):
            await open_channel(address, Identity(Kept(DRONE, identity.key)))


# -- enrolment -------------------------------------------------------------------------------------------------------


async def test_an_enrolment_survives_whatever_ends_it_between_its_steps(
    world: TowerWorld, hawk: NewDrone, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    token = (await root.post(f"/api/v1/drones/{hawk.id}/enrolments", json={})).json()["token"]
    folder = tmp_path / "drone"
    folder.mkdir()
    file = folder / "token"
    write_private(file, f"{hawk.key}\n")

    def killed(path: Path, text: str) -> None:
        if path == file:
            raise OSError(28, "No space left on device")
        write_private(path, text)

    with monkeypatch.context() as patched:
        patched.setattr(enrolment, "write_private", killed)
        with pytest.raises(Unusable, match="No space left"):
            await asyncio.to_thread(enrol, url(world), token, file)
    assert read_identity(file).key == hawk.key, "what was there stays there until all is well"
    assert record(world, hawk).public_key != hawk.key.public, "the tower has answered"
    assert await asyncio.to_thread(enrol, url(world), token, file) == "hawk"
    key = read_identity(file).key
    assert key is not None and key.public == record(world, hawk).public_key
    assert list(folder.iterdir()) == [file]
    assert file.stat().st_mode & 0o777 == 0o600
    async with signed_in(world, read_identity(file)):
        pass
    with pytest.raises(Unusable, match=r"not \(any more\) good"):
        await asyncio.to_thread(enrol, url(world), token, folder / "another")


async def test_an_agent_whose_file_holds_a_token_enrols_itself_at_its_start(
    world: TowerWorld, hawk: NewDrone, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    token = (await root.post(f"/api/v1/drones/{hawk.id}/enrolments", json={})).json()["token"]
    file = tmp_path / "token"
    write_private(file, f"{token}\n")
    waited: list[float] = []
    away = parse_tower_url("http://127.0.0.1:9")
    towers = iter([away, away, url(world)])

    def enrol_somewhere(_: TowerUrl, token: str, path: Path) -> str:
        return enrol(next(towers), token, path)  # it is not there yet

    monkeypatch.setattr(cli, "enrol_here", enrol_somewhere)
    monkeypatch.setattr(cli.time, "sleep", waited.append)
    await asyncio.to_thread(cli._enrol_first, url(world), file)
    assert len(waited) == 2
    key = read_identity(file).key
    assert key is not None
    assert key.public == record(world, hawk).public_key
    await asyncio.to_thread(cli._enrol_first, url(world), file)
    assert read_identity(file).key == key, "the next start has nothing to enrol"
