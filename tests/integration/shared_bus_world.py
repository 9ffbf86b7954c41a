"""Two towers in this process, on one PostgreSQL and one NATS; the fixtures that make them."""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, suppress
from pathlib import Path
from typing import Any

import asyncpg
import httpx
import pytest
from control_world import Live, ObedientAgent, live, until
from own_postgres import OwnPostgres, own_postgres
from tower_world import NewDrone, Person, TowerWorld, start_tower
from worlds.nats import TemporaryNats, nats_program, temporary_nats

from server.kernel.people import Role
from server.live.live_drone import LiveDrone
from server.runtime.vault import new_key
from server.towers.core.place import Place
from wire.dialect import mavlink
from wire.ids import DroneId
from wire.tagged import stamp, tag


@pytest.fixture(scope="module")
def nats(missing: Callable[[str], None]) -> Iterator[TemporaryNats]:
    program = nats_program()
    if program is None:
        missing("NATS (Debian: apt-get install nats-server)")
    assert program is not None
    with temporary_nats(program) as server:
        yield server


@pytest.fixture(scope="module")
def cluster(missing: Callable[[str], None]) -> Iterator[OwnPostgres]:
    with own_postgres(missing) as own:
        yield own


@pytest.fixture
async def postgres(cluster: OwnPostgres, request: pytest.FixtureRequest) -> OwnPostgres:
    """A database of the test's own."""
    connection = await asyncpg.connect(cluster.url)
    name = f"tower_{request.node.name.lower()}"[:60]
    await connection.execute(f'CREATE DATABASE "{name}"')
    await connection.close()
    return cluster.of(name)


class Two:
    """Towers `a` and `b`. The drone Kestrel is at home at `a`; Alice, its owner, and Root are connected to `b`."""

    a: TowerWorld
    b: TowerWorld
    drone: NewDrone
    owner: Person
    alice: httpx.AsyncClient
    root: httpx.AsyncClient
    alices: Live
    agent: ObedientAgent
    pings = 0
    """That Alice has answered."""

    async def begin(self, stack: AsyncExitStack, folder: Path, postgres: OwnPostgres, nats: TemporaryNats) -> "Two":
        key = new_key()
        self.stacks: dict[str, AsyncExitStack] = {}
        for name in ("a", "b"):
            var = folder / name
            var.mkdir()
            settings: dict[str, Any] = {
                "database_url": postgres.url.replace("postgresql://", "postgresql+asyncpg://"),
                "bus_url": nats.url,
                "secret_keys": key,
                "database_timeout_s": 5.0,
                "webhooks_may_be_private": True,
            }
            self.stacks[name] = await stack.enter_async_context(AsyncExitStack())
            setattr(self, name, await self.stacks[name].enter_async_context(start_tower(var, **settings)))
        root, alice = await self.a.add_user("Root", Role.ADMIN), await self.a.add_user("Alice")
        self.owner = alice
        self.drone = await self.a.add_drone("Kestrel", alice)
        await until("b to know the drone", lambda: self.drone.id in self.b.tower.hub.state.drones)
        await until("the towers to hear each other", lambda: self.is_ready(self.a) and self.is_ready(self.b))
        self.agent = ObedientAgent(self.a.tower.hub, self.drone.id)
        self.agent.state(armed=True, airborne=True)
        await until("the drone to be at home", lambda: self.at(self.a).place is Place.HERE)
        await until("b to know its home", lambda: self.at(self.b).place is Place.ELSEWHERE)
        self.alice, self.root = await self.b.signed_in(alice), await self.b.signed_in(root)
        self.alices = await stack.enter_async_context(live(self.b, self.alice))
        await self.alices.event("drone")
        return self

    async def end(self, name: str) -> None:
        """Ends one of the towers."""
        await self.stacks[name].aclose()

    def at(self, world: TowerWorld) -> LiveDrone:
        return world.tower.hub.state.drones[DroneId(self.drone.id)]

    @staticmethod
    def is_ready(world: TowerWorld) -> bool:
        several = world.tower.several
        assert several is not None
        return bool(list(several.towers.ready()))

    async def sticks(self, number: int = 0) -> None:
        frame = frame_of(mavlink.MAVLink_manual_control_message(1, number, 0, 500, 0, 0))
        await self.alices.socket.send(stamp(int(time.monotonic() * 1000)) + tag(DroneId(self.drone.id), frame))

    async def answer_pings_for(self, seconds: float) -> None:
        """As a browser does; a pilot whose round trip is not known to be short is made to hold."""
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                while True:
                    message = await self.alices.socket.recv()
                    if isinstance(message, str) and (event := json.loads(message))["type"] == "ping":
                        self.pings += 1
                        await self.alices.socket.send(json.dumps({"type": "pong", "sequence": event["sequence"]}))


SENDER = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
AUTOPILOT = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)


def frame_of(message: Any, by: Any = SENDER) -> bytes:
    return bytes(message.pack(by))


@pytest.fixture
async def two(tmp_path: Path, postgres: OwnPostgres, nats: TemporaryNats) -> AsyncIterator[Two]:
    async with AsyncExitStack() as stack:
        yield await Two().begin(stack, tmp_path, postgres, nats)
