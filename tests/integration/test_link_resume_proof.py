"""A lost control channel and its successor, at a real tower: who may resume a link, and who may not."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from agent_fakes import until
from data_link_world import DataLinkWorld, data_link_world
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from bench.key_sign_in import key_sign_in
from onboard_agent.sockets.control_channel import OpenedChannel, open_channel
from wire.control_messages import (
    KEY_SUBPROTOCOL,
    Hello,
    ResumeChallenge,
    ResumeProof,
    StreamSettings,
    ToAgent,
    ToTower,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.drone_key import DroneKey
from wire.ids import LinkId
from wire.resuming import Challenge


@pytest.fixture
async def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[DataLinkWorld]:
    async with data_link_world(tmp_path, monkeypatch) as world:
        await until(
            lambda: world.hub.links.resumable(world.link.link_id, world.drone_id, asyncio.get_running_loop().time())
        )
        yield world


@contextlib.asynccontextmanager
async def channel(world: DataLinkWorld, key: DroneKey, link_id: int) -> AsyncIterator[tuple[ClientConnection, Hello]]:
    """Yields a channel that has received the challenge, and the hello that answers it and names the link."""
    async with connect(
        world.tower.agent_url,
        subprotocols=[KEY_SUBPROTOCOL],  # type: ignore[list-item]
        proxy=None,
    ) as opened:
        yield opened, (await key_sign_in(opened, key, resume=link_id)).hello()


async def ask(opened: ClientConnection, message: ToTower) -> ToAgent:
    await opened.send(encode_message(message))
    return decode_to_agent(await asyncio.wait_for(opened.recv(), 30.0))


def key_of(world: DataLinkWorld) -> DroneKey:
    key = world.agent._link._identity.key
    assert key is not None
    return key


async def test_a_control_channel_that_breaks_off_is_replaced_and_the_link_goes_on(world: DataLinkWorld) -> None:
    link, channel = world.link, world.link.channel
    for times in (1, 2):
        opened: Any = world.agent._link._opened
        opened.connection.transport.abort()
        await until(lambda opened=opened: world.agent._link._opened not in (None, opened))  # type: ignore[misc]
        assert world.hub.state.traffic.links_resumed == times
    assert world.link is link and link.channel is not channel
    # Messages pass on the new control channel, both ways.
    drone = world.hub.state.drones.get(world.drone_id)
    assert drone is not None
    drone.armed = not drone.armed  # as if the tower had missed it
    world.autopilot.armed = not world.autopilot.armed
    await until(lambda: world.agent._onboard.autopilot.armed == world.autopilot.armed)
    await until(lambda: drone.armed == world.autopilot.armed)
    world.hub.changes.apply_stream(world.drone_id, StreamSettings(profile="thin"))  # type: ignore[arg-type]
    await until(lambda: drone.stream_state and drone.stream_state.profile == "thin")
    await world.reported_link(drone_id=world.drone_id)
    assert [e for e in world.watcher.events if e["type"] == "drone" and not e["drone"]["online"]] == []


async def test_what_the_autopilot_does_is_known_while_there_is_no_control_channel(
    world: DataLinkWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    drone = world.hub.state.drones.get(world.drone_id)
    assert drone is not None
    may_open = asyncio.Event()

    async def open_later(*args: Any, **more: Any) -> OpenedChannel:
        await may_open.wait()
        return await open_channel(*args, **more)

    monkeypatch.setattr("onboard_agent.sockets.tower_link.open_channel", open_later)
    opened: Any = world.agent._link._opened
    opened.connection.transport.abort()
    await until(lambda: not world.link.has_channel)
    armed = world.autopilot.armed = not drone.armed
    await until(lambda: drone.armed == armed)
    assert world.hub.state.traffic.links_resumed == 0
    may_open.set()
    await until(lambda: world.hub.state.traffic.links_resumed == 1)


async def test_a_wrong_proof_gets_a_link_of_its_own(world: DataLinkWorld) -> None:
    old = world.link
    async with channel(world, key_of(world), old.link_id) as (opened, hello):
        asked = await ask(opened, hello)
        assert isinstance(asked, ResumeChallenge)
        answer = await ask(opened, ResumeProof(proof=b"x" * 32))
        assert isinstance(answer, Welcome) and answer.link_id != old.link_id
        assert world.hub.state.traffic.links_resumed == 0


async def test_a_proof_of_one_channel_is_worth_nothing_on_another(world: DataLinkWorld) -> None:
    link = world.link
    key = key_of(world)
    async with (
        channel(world, key, link.link_id) as (first, said),
        channel(world, key, link.link_id) as (second, also_said),
    ):
        nonces = []
        for opened, hello in ((first, said), (second, also_said)):
            asked = await ask(opened, hello)
            assert isinstance(asked, ResumeChallenge)
            nonces.append(asked.nonce)
        assert nonces[0] != nonces[1]
        overheard = Challenge(
            link.resume_key, link_id=LinkId(link.link_id), public_key=said.public_key, nonce=nonces[0]
        ).by_agent()
        assert isinstance(await ask(second, ResumeProof(proof=overheard)), Welcome)


async def test_another_drones_key_is_not_even_asked_for_a_proof(world: DataLinkWorld) -> None:
    other = await world.tower.add_drone("Merlin")
    link = world.link
    async with channel(world, other.key, link.link_id) as (opened, hello):
        answer = await ask(opened, hello)
        assert isinstance(answer, Welcome) and answer.drone_id == other.id and answer.link_id != link.link_id
    assert world.link is link and world.agent._link.up


@pytest.mark.parametrize(
    "instead", ['{"type":"autopilot_state","heard":true,"armed":true,"airborne":true}', "nonsense"]
)
async def test_whoever_does_not_answer_the_challenge_is_sent_away(world: DataLinkWorld, instead: str) -> None:
    link = world.link
    async with channel(world, key_of(world), link.link_id) as (opened, hello):
        assert isinstance(await ask(opened, hello), ResumeChallenge)
        await opened.send(instead)
        with pytest.raises(ConnectionClosed):
            await asyncio.wait_for(opened.recv(), 30.0)
        assert opened.close_code == 4400
    assert world.link is link and world.agent._link.up, "the link that was named is untouched"
