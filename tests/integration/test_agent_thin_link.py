"""Stream profiles over real sockets: a manual profile takes effect at once, and `auto` follows a lossy network."""

import asyncio
import random
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from itertools import count
from typing import Any, NamedTuple

import pytest
from agent_fakes import FakeAutopilot, FakeTower, running_agent, running_autopilot, until

from onboard_agent.autopilot_port.udp import UdpIn
from onboard_agent.sockets import tower_link
from onboard_agent.telemetry import auto_profile, telemetry_stream
from wire.control_messages import StreamSettings, StreamState
from wire.dialect import mavlink
from wire.frames import message_id
from wire.stream_profiles import StreamChoice, StreamProfile

SEND_EVERY_S = 0.02
ATTITUDE = mavlink.MAVLINK_MSG_ID_ATTITUDE


class LossyTower(FakeTower):
    """A seeded network that loses a share of the agent's datagrams and counts those that arrive."""

    def __init__(self) -> None:
        super().__init__()
        self.lost_share = 0.0
        self.bytes_come = 0
        self._chance = random.Random(4)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        if self._chance.random() < self.lost_share:
            return
        self.bytes_come += len(data)
        super().datagram_received(data, addr)

    @property
    def states(self) -> list[StreamState]:
        return [message for message in self.messages if isinstance(message, StreamState)]

    @property
    def profile(self) -> StreamProfile | None:
        return self.states[-1].profile if self.states else None

    async def bytes_per_s(self, over_s: float) -> float:
        began, before = time.monotonic(), self.bytes_come
        await until(lambda: time.monotonic() - began >= over_s, over_s + 5)
        return (self.bytes_come - before) / (time.monotonic() - began)


class World(NamedTuple):
    tower: LossyTower
    autopilot: FakeAutopilot
    texts: list[bytes]
    """Returns all status texts of the autopilot."""


@asynccontextmanager
async def _chatty(autopilot: FakeAutopilot) -> AsyncIterator[list[bytes]]:
    """Sends attitude and position at 50 Hz, and a text with each fifth. Yields the texts."""
    texts: list[bytes] = []

    async def talk() -> None:
        for number in count():
            autopilot.say(mavlink.MAVLink_attitude_message(number, 0, 0, 0, 0, 0, 0))
            autopilot.say(mavlink.MAVLink_global_position_int_message(number, 1, 1, 1, 1, 1, 1, 1, 1))
            if number % 5 == 0:
                texts.append(autopilot.say(mavlink.MAVLink_statustext_message(6, f"number {number}".encode())))
            await asyncio.sleep(SEND_EVERY_S)

    talking = asyncio.create_task(talk())
    try:
        yield texts
    finally:
        talking.cancel()


@pytest.fixture
async def world() -> AsyncIterator[World]:
    port = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
    tower = LossyTower()
    await tower.start()
    try:
        async with running_agent(tower, port):
            await until(lambda: port.bound_port, what="the port is open")
            async with running_autopilot(port.bound_port) as autopilot, _chatty(autopilot) as texts:
                await tower.linked()
                await until(lambda: tower.frames, what="frames come")
                yield World(tower, autopilot, texts)
    finally:
        await tower.die()


async def test_a_profile_set_by_hand_cuts_what_is_sent_and_gives_it_back(world: World) -> None:
    tower = world.tower
    await until(lambda: tower.profile is StreamProfile.FULL, what="it is told which profile is in force")
    full = await tower.bytes_per_s(1.0)
    await tower.announce(StreamSettings(profile=StreamChoice.MINIMAL))
    await until(lambda: tower.profile is StreamProfile.MINIMAL, what="it is told to be in force")
    assert tower.states[-1].why == "set by an admin"
    tower.frames.clear()
    minimal = await tower.bytes_per_s(3.0)
    assert minimal < full / 3
    states = [frame for frame in tower.frames if message_id(frame) == ATTITUDE]
    assert 1 <= len(states) <= 6, "of 150: one a second, one at the change, one that was on its way"
    assert len(set(states)) == len(states)
    await tower.announce(StreamSettings(profile=StreamChoice.FULL))
    await until(lambda: tower.profile is StreamProfile.FULL)
    assert await tower.bytes_per_s(1.0) > full / 2


async def test_what_is_no_state_all_arrives_in_order_in_the_thinnest_profile(world: World) -> None:
    tower = world.tower
    await tower.announce(StreamSettings(profile=StreamChoice.MINIMAL))
    await until(lambda: tower.profile is StreamProfile.MINIMAL)
    first = len(world.texts)
    await until(lambda: len(world.texts) >= first + 20)
    expected = world.texts[first:]
    await until(lambda: expected[-1] in tower.frames, what="the last text has come")
    assert [frame for frame in tower.frames if frame in expected] == expected


async def test_auto_goes_down_on_a_lossy_network_and_comes_back(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    tower = world.tower
    monkeypatch.setattr(telemetry_stream, "SETTLED_AFTER_S", 1.0)
    monkeypatch.setattr(tower_link, "LOSS_OVER_S", 5.0)
    monkeypatch.setattr(auto_profile, "UP_AFTER_S", 1.0)
    full = await tower.bytes_per_s(1.0)
    tower.lost_share = 0.6
    await until(lambda: tower.profile is StreamProfile.MINIMAL, 30, "the agent sends less")
    assert "lost" in tower.states[-1].why
    tower.lost_share = 0.0
    assert await tower.bytes_per_s(1.0) < full / 2
    await until(lambda: tower.profile is StreamProfile.FULL, 60, "the agent sends all again")
    profiles = [state.profile for state in tower.states]
    assert profiles[-3:] == [StreamProfile.MINIMAL, StreamProfile.THIN, StreamProfile.FULL]
    rates = [await tower.bytes_per_s(1.0)]
    while rates[-1] <= full / 2:  # a second in which other tests had the processor says nothing
        assert len(rates) < 20, rates
        rates.append(await tower.bytes_per_s(1.0))
