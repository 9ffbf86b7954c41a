"""A real tower, a real agent and a fake autopilot, with a UDP proxy between them that a test can make misbehave."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from agent_fakes import FakeAutopilot, running_autopilot, until
from control_world import Live, live
from network_between import tcp_through, udp_through
from tower_world import TowerWorld, start_tower
from udp_proxy import UdpProxy, running_proxy

from bench.namespaces import Network
from onboard_agent.agent import Agent, AgentSettings
from onboard_agent.autopilot_port.udp import UdpIn
from onboard_agent.link.tower_url import parse_tower_url
from server.kernel.people import Role
from server.link.api.data_endpoint import DataEndpoint
from server.link.core.agent_link import AgentLink
from server.live.hub import Hub
from wire.ids import DroneId
from wire.transport_choice import Transport


@dataclass
class DataLinkWorld:
    """`watcher` is the browser of an admin."""

    tower: TowerWorld
    proxy: UdpProxy
    agent: Agent
    autopilot: FakeAutopilot
    watcher: Live
    client: httpx.AsyncClient
    drone_id: DroneId

    @property
    def hub(self) -> Hub:
        return self.tower.tower.hub

    @property
    def link(self) -> AgentLink:
        """The tower's end of the link."""
        drone = self.hub.state.drones.get(self.drone_id)
        assert drone is not None and drone.link is not None
        return drone.link

    async def reported_link(self, **fields: Any) -> dict[str, Any]:
        """Returns the next link report to the watcher with these fields."""
        while True:
            for reported in (await self.watcher.event("links"))["links"]:
                if fields.items() <= reported.items():
                    return dict(reported)

    @property
    def transport(self) -> Transport:
        """The agent's current transport."""
        data = self.agent._link._data
        assert data is not None
        return data.choice.transport


@contextlib.asynccontextmanager
async def data_link_world(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    *,
    uplinks: Sequence[str] = ("",),
    blocked: bool = False,
    largest_bytes: int = 65535,
    net: Network | None = None,
) -> AsyncIterator[DataLinkWorld]:
    async with contextlib.AsyncExitStack() as stack:
        tower = await stack.enter_async_context(start_tower(tmp_path))
        admin = await tower.add_user("admin", Role.ADMIN)
        drone = await tower.add_drone("Kestrel", admin)
        url = tower.base_url
        tower_udp = ("127.0.0.1", tower.udp_port)
        if net is None:
            proxy = await stack.enter_async_context(running_proxy(tower_udp))
        else:
            proxy = await stack.enter_async_context(udp_through(net, tower_udp))
            port = await stack.enter_async_context(tcp_through(net, ("127.0.0.1", urlsplit(url).port or 0)))
            url = f"http://127.0.0.1:{port}"
        proxy.largest_bytes = largest_bytes
        if blocked:
            proxy.blocked.add("")
        # The tower announces the proxy's port to agents instead of its own.
        monkeypatch.setattr(DataEndpoint, "port", proxy.port)
        client = await tower.signed_in(admin)
        watcher = await stack.enter_async_context(live(tower, client))
        line = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
        settings = AgentSettings(
            tower=parse_tower_url(url),
            identity=drone.identity,
            port=line,
            uplinks=tuple(uplinks),
        )
        agent = Agent(settings)
        running = asyncio.create_task(agent.run())
        try:
            await until(lambda: line.bound_port, what="the autopilot's port is open")
            autopilot = await stack.enter_async_context(running_autopilot(line.bound_port))
            world = DataLinkWorld(tower, proxy, agent, autopilot, watcher, client, DroneId(drone.id))
            await until(lambda: agent._link.up, 30.0, "the agent has signed in")
            yield world
        finally:
            running.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await running
