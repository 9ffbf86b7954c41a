"""A drone that alice holds and bob may watch, with a working agent, in a running tower."""

from datetime import timedelta
from typing import Any

import httpx
from control_world import ask
from tower_world import TowerWorld
from working_agent import WorkingAgent

from server.kernel.people import Role

HOME = (47.0, 8.0, 500.0)


class Scene:
    """alice holds kestrel, bob also owns it, and the agent is connected."""

    def __init__(self, world: TowerWorld) -> None:
        self.world = world

    async def begin(self) -> None:
        world = self.world
        self.alice, self.bob = await world.add_user("alice"), await world.add_user("bob")
        self.root = await world.add_user("root", Role.ADMIN)
        self.drone = await world.add_drone("kestrel", self.alice, self.bob)
        self.holder, self.watcher = await world.signed_in(self.alice), await world.signed_in(self.bob)
        self.admin = await world.signed_in(self.root)
        self.agent = WorkingAgent(world.tower.hub, self.drone.id)
        self.agent.beat()
        self.agent.home(*HOME)
        answer = await ask(self.holder, self.drone.id, "acquire")
        assert answer.status_code == 200, answer.text

    @property
    def path(self) -> str:
        return f"/api/v1/drones/{self.drone.id}"

    async def lend_to_carol(self, **terms: Any) -> httpx.AsyncClient:
        """Lends the drone to carol, who then holds it."""
        carol = await self.world.add_user("carol")
        until_ = (self.world.clock() + timedelta(hours=1)).isoformat()
        await ask(self.holder, self.drone.id, "release")
        lent = await self.admin.put(f"{self.path}/loans/{carol.id}", json={"until": until_} | terms)
        assert lent.status_code == 200, lent.text
        client = await self.world.signed_in(carol)
        assert (await ask(client, self.drone.id, "acquire")).status_code == 200
        return client
