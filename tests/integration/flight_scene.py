"""A drone whose flights are recorded, in a running tower."""

import asyncio
from typing import Any

import httpx
from control_world import until
from flying_scene import Scene

from wire.dialect import mavlink


class FlightScene(Scene):
    """A drone whose flights are recorded."""

    async def begin(self) -> None:
        await super().begin()
        self.number = 0

    def positions(self, count: int = 10) -> None:
        """So many messages of the autopilot, along a line to the north."""
        for _ in range(count):
            self.number += 1
            at = 470_000_000 + self.number * 1000, 80_000_000, 520_000, 20_000
            self.agent.frame(mavlink.MAVLink_global_position_int_message(self.number, *at, 100, 0, 0, 9000))

    async def arm(self) -> None:
        running = self.world.tower.hub.flights.running
        self.agent.state(armed=True, airborne=True)
        await until("a flight to begin", lambda: self.world.tower.hub.flights.running == running + 1)

    async def land(self) -> None:
        self.agent.state(armed=False, airborne=False)
        await until("the flight to end", lambda: self.world.tower.hub.flights.running == 0)

    async def flights(self, client: httpx.AsyncClient | None = None, **query: Any) -> list[dict[str, Any]]:
        answer = await (client or self.holder).get("/api/v1/flights", params=query)
        assert answer.status_code == 200, answer.text
        found: list[dict[str, Any]] = answer.json()["flights"]
        return found

    async def listed(self) -> dict[str, Any]:
        """Waits until the flight that goes on is listed: its row is written in the background."""
        deadline = asyncio.get_running_loop().time() + 30
        while not (found := await self.flights()):
            assert asyncio.get_running_loop().time() < deadline
            await asyncio.sleep(0.05)
        return found[0]

    async def ready(self, count: int = 1) -> list[dict[str, Any]]:
        """Waits until so many flights can be downloaded."""
        deadline = asyncio.get_running_loop().time() + 30
        while True:
            found = await self.flights()
            if len(found) == count and all(one["state"] != "recording" for one in found):
                return found
            assert asyncio.get_running_loop().time() < deadline, found
            await asyncio.sleep(0.05)

    async def whole(self, frames: int = 10) -> dict[str, Any]:
        """Flies once."""
        before = len(await self.flights())
        await self.arm()
        self.positions(frames)
        await self.land()
        return (await self.ready(before + 1))[0]

    @property
    def files(self) -> list[str]:
        folder = self.world.settings.files / "flights" / f"drone-{self.drone.id}"
        return sorted(path.suffix for path in folder.iterdir()) if folder.is_dir() else []
