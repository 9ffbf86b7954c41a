"""The agent between a fake tower and a fake autopilot, on real sockets: linking, forwarding, reconnecting."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator
from typing import NamedTuple

import pytest
from agent_fakes import (
    DRONE,
    FakeAutopilot,
    FakeTower,
    running_agent,
    running_autopilot,
    running_tower,
    until,
)

from onboard_agent.agent import Agent, AgentSettings
from onboard_agent.autopilot_port.udp import UdpIn
from onboard_agent.link.identity import Identity, Kept
from onboard_agent.link.tower_url import parse_tower_url
from wire.dialect import build, mavlink
from wire.drone_key import DroneKey
from wire.ids import DroneId, LinkId
from wire.sealed_link import SealedLink


class World(NamedTuple):
    tower: FakeTower
    agent: Agent
    autopilot: FakeAutopilot


@pytest.fixture
async def world() -> AsyncIterator[World]:
    port = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
    async with running_tower() as tower, running_agent(tower, port) as agent:
        await until(lambda: port.bound_port, what="the port is open")
        async with running_autopilot(port.bound_port) as autopilot:
            await tower.linked()
            await until(lambda: tower.saw_autopilot(armed=False, airborne=False))
            yield World(tower, agent, autopilot)


def attitude(sequence: int = 0) -> bytes:
    message = mavlink.MAVLink_attitude_message(1000 + sequence, 0.1, 0.2, 0.3, 0, 0, 0)
    return build(message, system_id=1, component_id=1, sequence=sequence)


def signed_attitude() -> bytes:
    packer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    packer.signing.secret_key = b"k" * 32
    packer.signing.sign_outgoing = True
    packer.signing.timestamp = 1
    frame = bytes(mavlink.MAVLink_attitude_message(5, 0.1, 0.2, 0.3, 0, 0, 0).pack(packer))
    assert frame[2] == 1
    return frame


def version_1_attitude() -> bytes:
    packer = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    frame = bytes(mavlink.MAVLink_attitude_message(6, 0.1, 0.2, 0.3, 0, 0, 0).pack(packer, force_mavlink1=True))
    assert frame[0] == 0xFE
    return frame


KINDS = {"version 2": attitude(), "signed": signed_attitude(), "version 1": version_1_attitude()}


@pytest.mark.parametrize("kind", KINDS)
async def test_frames_go_up_byte_for_byte(world: World, kind: str) -> None:
    world.autopilot.send(KINDS[kind])
    await until(lambda: KINDS[kind] in world.tower.frames)


@pytest.mark.parametrize("kind", KINDS)
async def test_frames_go_down_byte_for_byte(world: World, kind: str) -> None:
    world.tower.send_frames(KINDS[kind])
    await until(lambda: KINDS[kind] in world.autopilot.frames)


async def test_frames_of_one_packet_keep_their_order_and_carry_the_epoch(world: World) -> None:
    frames = [attitude(n) for n in range(100, 120)]
    world.autopilot.send(b"".join(frames))
    await until(lambda: frames[-1] in world.tower.frames)
    start = world.tower.frames.index(frames[0])
    assert world.tower.frames[start : start + 20] == frames
    assert world.tower.epochs_seen[-1] == 1


async def test_a_signing_key_passes_in_neither_direction(world: World) -> None:
    setup = build(mavlink.MAVLink_setup_signing_message(1, 1, [7] * 32, 0), system_id=255, component_id=190, sequence=0)
    world.autopilot.send(setup + attitude(31))
    world.tower.send_frames(setup, attitude(32))
    await until(lambda: attitude(31) in world.tower.frames and attitude(32) in world.autopilot.frames)
    assert setup not in world.tower.frames
    assert setup not in world.autopilot.frames


async def test_what_must_not_reach_the_autopilot_does_not(world: World) -> None:
    tower = world.tower
    tower.send_frames(attitude(1), epoch=0)
    tower.send_frames(attitude(2), drone_id=DRONE + 1)
    spoiled = bytearray(attitude(3))
    spoiled[12] ^= 1
    tower.send_frames(bytes(spoiled))
    stranger = SealedLink(
        link_id=LinkId(1), drone_id=DroneId(DRONE), send_key=b"x" * 32, receive_key=b"y" * 32, now=0.0
    )
    for datagram in stranger.seal_frames(1, [attitude(4)], 0.0):  # type: ignore[arg-type]
        tower.send_raw(datagram)
    tower.send_raw(b"")
    tower.send_raw(b"\x01\x00\x01")
    tower.send_raw(bytes(1400))
    tower.send_frames(attitude(5))
    await until(lambda: attitude(5) in world.autopilot.frames)
    assert not {attitude(1), attitude(2), bytes(spoiled), attitude(4)} & set(world.autopilot.frames)


async def test_a_newer_epoch_in_a_datagram_shuts_out_the_older(world: World) -> None:
    world.tower.send_frames(attitude(1), epoch=9)
    world.tower.send_frames(attitude(2), epoch=8)
    world.tower.send_frames(attitude(3), epoch=9)
    await until(lambda: attitude(3) in world.autopilot.frames)
    assert attitude(1) in world.autopilot.frames
    assert attitude(2) not in world.autopilot.frames


async def test_rates_are_asked_for_one_at_a_time(world: World) -> None:
    await until(lambda: len(world.autopilot.heard("COMMAND_LONG")) >= 15)
    asked = [int(m.param1) for m in world.autopilot.heard("COMMAND_LONG")]
    assert asked[0] == mavlink.MAVLINK_MSG_ID_ATTITUDE
    assert len(asked) == len(set(asked)) == 15


async def test_the_agent_comes_back_after_the_tower_was_killed(world: World) -> None:
    port = world.tower.port
    await world.tower.die()
    await asyncio.sleep(0)
    await world.tower.start(port)
    await world.tower.linked(2)
    world.autopilot.send(attitude(77))
    await until(lambda: attitude(77) in world.tower.frames)
    world.tower.send_frames(attitude(78))
    await until(lambda: attitude(78) in world.autopilot.frames)


async def test_another_source_port_is_tried_when_udp_alone_is_silent(world: World) -> None:
    world.tower.deaf_on_udp = True
    first = list(world.tower.addresses)
    await until(lambda: len(world.tower.addresses) > len(first), 8.0, "a new source port")
    assert world.tower.over_websocket > 0, "meanwhile it is told over the control channel"
    world.tower.deaf_on_udp = False
    answered = len(world.tower.frames)
    await until(lambda: len(world.tower.frames) > answered, what="frames over UDP again")
    world.autopilot.send(attitude(50))
    await until(lambda: attitude(50) in world.tower.frames)
    assert len(world.tower.hellos) == 1, "the control channel was left alone"


async def test_a_refused_key_is_said_clearly(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    port = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
    async with running_tower() as tower:
        wrong = Identity(Kept(DRONE, DroneKey(DRONE, b"w" * 32)))
        url = parse_tower_url(f"http://127.0.0.1:{tower.port}")
        task = asyncio.create_task(Agent(AgentSettings(tower=url, identity=wrong, port=port)).run())
        await until(lambda: "the tower refuses this drone: unknown drone key" in caplog.text)
        assert str(wrong.key) not in caplog.text
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


async def test_a_message_of_the_tower_that_cannot_be_read_costs_itself_alone(world: World) -> None:
    assert world.tower.connection is not None
    for nonsense in ('{"type": "self_destruct"}', '{"type":"nearby_zones","lat_e7":950000000}', "no JSON"):
        await world.tower.connection.send(nonsense)
    await world.tower.connection.send(b"\x00\x01")
    await until(lambda: world.agent._link.counts["too_short"] == 1, what="a datagram that is none is counted")
    assert world.agent._link.counts["malformed"] == 3
    world.tower.send_frames(attitude(60))
    await until(lambda: attitude(60) in world.autopilot.frames)
    assert len(world.tower.hellos) == 1


async def test_being_replaced_is_said_and_not_fought_over(world: World, caplog: pytest.LogCaptureFixture) -> None:
    assert world.tower.connection is not None
    await world.tower.connection.close(4409, "replaced")
    await until(lambda: "another agent has signed in" in caplog.text)
    beats = len(world.autopilot.heard("HEARTBEAT"))
    await until(lambda: len(world.autopilot.heard("HEARTBEAT")) >= beats + 2, what="two seconds of the agent's beats")
    assert len(world.tower.hellos) == 1
