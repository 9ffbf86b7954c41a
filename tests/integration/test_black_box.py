"""A link cut in flight: the tower fetches what it missed from the drone, and its recording has no gap.

`BLACK_BOX_CUT_S` sets how long the cut lasts.
"""

import asyncio
import contextlib
import itertools
import os
from collections import Counter
from collections.abc import AsyncIterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from agent_fakes import FakeAutopilot, running_autopilot, until
from tcp_switch import TcpSwitch
from tower_world import TowerWorld, start_tower
from udp_proxy import UdpProxy, running_proxy

from onboard_agent.agent import Agent, AgentSettings
from onboard_agent.autopilot_port.udp import UdpIn
from onboard_agent.black_box import tape
from onboard_agent.black_box.flight_files import CSV
from onboard_agent.link.tower_url import parse_tower_url
from server.flights.core import gap_watch, recorder
from server.flights.core.tlog import read_entries
from server.kernel.people import Role
from server.link.api.data_endpoint import DataEndpoint
from server.live.hub import Hub
from wire.dialect import mavlink
from wire.ids import DroneId

CUT_S = float(os.environ.get("BLACK_BOX_CUT_S", "4"))
RATE_HZ = 50


class FlyingAutopilot:
    """Sends ATTITUDE at 50 Hz, each different, and remembers all that it sends and when."""

    def __init__(self, autopilot: FakeAutopilot) -> None:
        self.autopilot = autopilot
        self.sent: list[tuple[float, bytes]] = []
        self._loop = asyncio.get_running_loop()

    async def fly(self) -> None:
        number, due = 0, self._loop.time()
        while True:
            number += 1
            message = mavlink.MAVLink_attitude_message(number, 0.01 * number, 0.1, 0.2, 0.0, 0.0, 0.0)
            self.sent.append((self._loop.time(), self.autopilot.say(message)))
            due += 1 / RATE_HZ
            await asyncio.sleep(max(0.0, due - self._loop.time()))


class World:
    def __init__(
        self,
        tower: TowerWorld,
        proxy: UdpProxy,
        switch: TcpSwitch,
        client: httpx.AsyncClient,
        autopilot: FlyingAutopilot,
        drone_id: DroneId,
        state: Path,
    ) -> None:
        self.tower, self.proxy, self.switch, self.client = tower, proxy, switch, client
        self.autopilot, self.drone_id, self.state = autopilot, drone_id, state

    @property
    def hub(self) -> Hub:
        return self.tower.tower.hub

    def cut(self) -> None:
        self.proxy.blocked.add("")
        self.switch.cut()

    def mend(self) -> None:
        self.proxy.blocked.clear()
        self.switch.turn_to(urlsplit(self.tower.base_url).port or 0)


@pytest.fixture
async def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[World]:
    monkeypatch.setattr(recorder, "AFTER_S", 0.5)
    monkeypatch.setattr(tape, "AFTER_S", 1.0)
    monkeypatch.setattr(gap_watch, "MARGIN_US", 3_000_000)
    async with contextlib.AsyncExitStack() as stack:
        tower = await stack.enter_async_context(start_tower(tmp_path))
        admin = await tower.add_user("admin", Role.ADMIN)
        drone = await tower.add_drone("Kestrel", admin)
        proxy = await stack.enter_async_context(running_proxy(("127.0.0.1", tower.udp_port)))
        switch = TcpSwitch(urlsplit(tower.base_url).port or 0)
        stack.callback(switch.close)
        monkeypatch.setattr(DataEndpoint, "port", proxy.port)
        line = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
        state = tmp_path / "agent"
        settings = AgentSettings(
            tower=parse_tower_url(f"http://127.0.0.1:{switch.port}"),
            identity=drone.identity,
            port=line,
            state=state,
            black_box_mb=100,
        )
        agent = Agent(settings)
        running = asyncio.create_task(agent.run())
        try:
            await until(lambda: line.bound_port, what="the autopilot's port is open")
            autopilot = await stack.enter_async_context(running_autopilot(line.bound_port))
            await until(lambda: agent._link.up, 30.0, "the agent has signed in")
            client = await tower.signed_in(admin)
            yield World(tower, proxy, switch, client, FlyingAutopilot(autopilot), DroneId(drone.id), state)
        finally:
            running.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await running


async def test_a_cut_link_leaves_no_gap_in_the_flight(world: World) -> None:
    hub = world.hub
    world.autopilot.autopilot.armed = True
    world.autopilot.autopilot.alt_rel_m = 20.0
    flying = asyncio.create_task(world.autopilot.fly())
    await until(lambda: hub.flights.running == 1, what="a flight is recorded")
    await asyncio.sleep(1.0)
    cut_at = asyncio.get_running_loop().time()
    world.cut()
    await asyncio.sleep(CUT_S)
    world.mend()
    drone = hub.state.drones[world.drone_id]
    await until(lambda: drone.online and drone.armed, 30.0, "the link is back")
    back_at = asyncio.get_running_loop().time()
    await until(lambda: hub.black_box.counts["fetched"] == 1, 60.0 + 2 * CUT_S, "the gap is fetched in flight")
    fetched_at = asyncio.get_running_loop().time()
    world.autopilot.autopilot.armed = False
    await until(lambda: hub.flights.running == 0, what="the flight is over")
    flying.cancel()

    gaps = world.tower.tower.flights.gaps
    await until(lambda: gaps.frames > 0, 30.0, "the gap is merged")
    (flight,) = (await world.client.get("/api/v1/flights")).json()["flights"]
    content = (await world.client.get(f"/api/v1/flights/{flight['id']}/tlog")).content
    file = world.state / "flight.tlog"
    file.write_bytes(content)
    with file.open("rb") as opened:
        entries = list(read_entries(opened))
    assert flight["frames"] == len(entries), "the catalogue follows"
    assert all(one.at_us <= after.at_us for one, after in itertools.pairwise(entries)), "in order of time"

    recorded = Counter(one.frame for one in entries)
    expected = [(at, frame) for at, frame in world.autopilot.sent if cut_at - 0.5 <= at <= back_at + 0.5]
    assert len(expected) > CUT_S * RATE_HZ
    missing = [at - cut_at for at, frame in expected if recorded[frame] != 1]
    assert not missing, f"{len(missing)} of {len(expected)} frames, at {missing[:5]} s"
    order = {frame: number for number, (_, frame) in enumerate(world.autopilot.sent)}
    numbers = [order[one.frame] for one in entries if one.frame in order]
    assert numbers == sorted(numbers), "as the autopilot sent them"
    sent_at = {frame: at for at, frame in expected}
    shifts = sorted(one.at_us / 1e6 - sent_at[one.frame] for one in entries if one.frame in sent_at)
    assert shifts[-1] - shifts[0] < 0.5, "fetched frames have the times of the tower's clock"

    index = (await world.client.get(f"/api/v1/flights/{flight['id']}")).json()["index"]
    kinds = Counter(one["kind"] for one in index)
    assert kinds["black_box"] == 1
    await until(lambda: list(world.state.glob(f"black-box/*{CSV}")), what="the drone has a table of its flight")
    print(
        f"cut {CUT_S:.0f} s, {len(expected)} frames of the autopilot in it and beside it, {gaps.frames} fetched, "
        f"{hub.black_box.counts['bytes']} bytes in {fetched_at - back_at:.1f} s"
    )
