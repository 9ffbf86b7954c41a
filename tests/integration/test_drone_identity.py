"""A drone's key is its identity: sign-in, replays, relays, revocation and certificate binding."""

import asyncio
import ssl
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest
from identity_world import _agent, channel, public_half_of, refused, signed_in, url
from tower_world import NewDrone, TowerWorld, start_tower
from websockets.exceptions import ConnectionClosed

from bench.key_sign_in import key_sign_in
from bench.tls_front import TlsFront, make_certificate
from onboard_agent.link.identity import Identity, Kept
from onboard_agent.link.tower_url import parse_tower_url
from onboard_agent.sockets import control_channel
from onboard_agent.sockets.control_channel import CredentialRefused, NoLink, open_channel, try_sign_in
from server.kernel.people import Role
from server.link.api import agent_sign_in
from server.link.api.tls_binding import TlsBinding
from wire.channel_binding import end_point
from wire.control_messages import (
    Hello,
    ResumeChallenge,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.credential import Credential
from wire.drone_key import DroneKey
from wire.ids import DroneId


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def hawk(world: TowerWorld) -> NewDrone:
    return await world.add_drone("hawk")


# -- signing in ----------------------------------------------------------------------------------------------------


async def test_a_drone_signs_in_by_its_key_and_learns_which_tower_is_its_own(world: TowerWorld, hawk: NewDrone) -> None:
    identity = Identity(Kept(hawk.key.drone_id, hawk.key), lambda _: None)
    async with signed_in(world, identity) as opened:
        drone = world.tower.hub.state.drones.get(DroneId(hawk.id))
        assert drone is not None and drone.link is not None
        assert drone.link.resume_key == opened.resume_key
        assert drone.link.ticket == opened.welcome.ticket != ""
        assert identity.tower_key == world.tower.sign_in_rules.identity.public_key
        # A trial sign-in takes no link from a flying agent.
        assert await try_sign_in(url(world), identity) == "the drone's key"
        assert drone.link.link_id == opened.welcome.link_id
    stranger = Identity(Kept(hawk.key.drone_id, hawk.key, tower_key=b"T" * 32))
    with pytest.raises(NoLink, match="is not the tower that enrolled this drone"):
        await open_channel(url(world), stranger)


async def test_a_signature_is_worth_nothing_a_second_time_nor_with_anything_else_in_its_place(
    world: TowerWorld, hawk: NewDrone
) -> None:
    """Replays it, moves it to another challenge, and changes each field of the hello."""
    kite = await world.add_drone("kite")
    async with channel(world) as first:
        said = (await key_sign_in(first, hawk.key)).hello()
        assert said.sign_in is not None
        await first.send(encode_message(said))
        assert isinstance(decode_to_agent(str(await first.recv())), Welcome)
        async with channel(world) as again:
            await again.recv()
            await again.send(encode_message(said))
            assert "unknown drone key" in await refused(again)
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
            assert "unknown drone key" in await refused(opened), what
    async with channel(world) as opened:
        hello = (await key_sign_in(opened, hawk.key)).hello()
        await opened.send(encode_message(_with(hello, sign_in=_with(hello.sign_in, binding=b"b" * 32))))
        assert "another TLS certificate" in await refused(opened)


def _with(struct: Any, **changes: Any) -> Any:
    return msgspec.structs.replace(struct, **changes)


async def test_who_relays_to_another_tower_gets_nowhere(world: TowerWorld, hawk: NewDrone) -> None:
    """An attacker's tower relays this tower's nonce to the agent, with its own identity or link keys."""
    thief = b"\x05" * 32
    for lie in ("tower_key", "public_key"):
        async with channel(world) as opened:
            challenge = decode_to_agent(str(await opened.recv()))
            shown = _with(challenge, **{lie: public_half_of(thief) if lie == "tower_key" else thief})
            sign_in = _agent(shown, hawk.key)
            await opened.send(encode_message(sign_in.hello()))
            assert "unknown drone key" in await refused(opened)


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
        drone = world.tower.hub.state.drones.get(DroneId(hawk.id))
        assert drone is not None and drone.link is not None
        link = drone.link
        # The key is revoked after it is proven, when the tower asks for the link that it names.
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
    with pytest.raises(CredentialRefused, match="unknown drone key"):
        await open_channel(url(world), hawk.identity)


async def test_the_signature_is_bound_to_the_certificate_that_the_tower_was_told(
    world: TowerWorld, hawk: NewDrone, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A proxy in between has a certificate that the agent also trusts, and forwards both sides' messages."""
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
    # The proxy has a new certificate and its file has changed: both certificates are accepted.
    binding = TlsBinding(ours)
    assert binding.is_ours(_end_point(ours))
    ours.write_bytes(theirs.read_bytes())
    assert binding.is_ours(_end_point(theirs))
    assert not binding.is_ours(b"")


def _end_point(certificate: Path) -> bytes:
    return end_point(ssl.PEM_cert_to_DER_cert(certificate.read_text()))


# -- the exchange of a credential ------------------------------------------------------------------------------------


@pytest.fixture
async def credential(world: TowerWorld, hawk: NewDrone) -> Credential:
    return await world.give_credential(hawk)
