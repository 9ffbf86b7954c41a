"""Blocked UDP, both ways or one: the same datagrams over the WebSocket, and back when UDP works again."""

import asyncio
import time
from pathlib import Path

import pytest
from agent_fakes import until
from data_link_world import DataLinkWorld, data_link_world

from server.link.core.agent_routes import OVER_CHANNEL
from wire.dialect import build, mavlink
from wire.drops import DropReason
from wire.tagged import split_tagged
from wire.transport_choice import Transport

WITHIN_S = 3.0
ON_A_BUSY_MACHINE_S = 2.0


def attitude(number: int) -> bytes:
    message = mavlink.MAVLink_attitude_message(number, 0.1, 0.2, 0.3, 0, 0, 0)
    return build(message, system_id=1, component_id=1, sequence=number & 0xFF)


async def frames_come(world: DataLinkWorld, number: int) -> None:
    """Waits until a frame from the autopilot reaches the browser. Repeats the frame, as an autopilot does."""
    sent = {attitude(number + n) for n in range(200)}
    async with asyncio.timeout(10.0):
        for frame in sorted(sent):
            world.autopilot.send(frame)
            try:
                async with asyncio.timeout(0.1):
                    while True:
                        message = await world.watcher.socket.recv()
                        if isinstance(message, bytes) and sent & {got for _, got in split_tagged(message)}:
                            return
            except TimeoutError:
                continue
    raise AssertionError("no frame came")


@pytest.mark.parametrize("upwards_only", [False, True])
async def test_udp_blocked_means_the_websocket_within_3_s_and_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, upwards_only: bool
) -> None:
    async with data_link_world(tmp_path, monkeypatch) as world:
        await frames_come(world, 1000)
        assert world.transport is Transport.UDP
        begin = time.monotonic()
        if upwards_only:
            world.proxy.blocked_up = True
        else:
            world.proxy.blocked.add("")
        await until(lambda: world.link.routes.newest == OVER_CHANNEL, WITHIN_S + ON_A_BUSY_MACHINE_S)
        took_s = time.monotonic() - begin
        assert took_s < WITHIN_S + ON_A_BUSY_MACHINE_S
        await frames_come(world, 2000)
        reported = await world.reported_link(transport="websocket")
        assert reported["drone_id"] == world.drone_id
        assert world.agent._link.up
        world.proxy.blocked.clear()
        world.proxy.blocked_up = False
        await until(lambda: world.link.routes.newest not in (None, OVER_CHANNEL), 10.0, "back on UDP")
        await frames_come(world, 3000)
        await world.reported_link(transport="udp")
        assert world.hub.state.drops[DropReason.NOT_AUTHENTIC] == world.hub.state.drops[DropReason.REPLAYED] == 0


async def test_an_agent_that_never_has_udp_is_online_over_the_websocket(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with data_link_world(tmp_path, monkeypatch, blocked=True) as world:
        await frames_come(world, 1000)
        drone = world.hub.state.drones.get(world.drone_id)
        assert drone is not None and drone.online
        assert world.transport is Transport.WEBSOCKET
        # The second successful ping reports the round trip of the first.
        await until(lambda: world.link.sealed.keepalive.rtt_s, 3.0, "told by the second ping")


async def test_a_channel_carries_datagrams_of_its_own_link_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with data_link_world(tmp_path, monkeypatch) as world:
        await frames_come(world, 1000)
        opened = world.agent._link._opened
        assert opened is not None
        _, seen = world.proxy.up[0]
        await opened.connection.send(b"nonsense")
        await opened.connection.send(seen[:2] + bytes(4) + seen[6:])
        await opened.connection.send(seen)
        await until(lambda: world.hub.state.drops[DropReason.DUPLICATE] == 1)
        assert world.hub.state.drops[DropReason.TOO_SHORT] == 1
        assert world.hub.state.drops[DropReason.UNKNOWN_LINK] == 1
        assert world.link.routes.newest != OVER_CHANNEL
        await frames_come(world, 2000)
