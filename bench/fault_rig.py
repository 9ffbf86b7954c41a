"""Two towers, PostgreSQL, NATS, and a simulated drone with a tap at its autopilot's port; pilot and admin fly by hand.

Both send sticks all the time. The tap tells whose arrive.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

import asyncpg  # type: ignore[import-untyped]
import httpx
from websockets.exceptions import WebSocketException

from bench.fault_services import FaultyPostgres
from bench.person import Person, Refused, Sticks
from bench.rig import BIN, PASSWORD, Kind, Rig, free_udp_port, wait_for
from bench.tap import ADMIN, OPERATOR

KIND: Final = Kind("ardupilot", radio=True)
LOOK_AGAIN_S: Final = 0.1
START_AGAIN_S: Final = 1.0
GONE: Final = (OSError, WebSocketException, TimeoutError, httpx.HTTPError, Refused)


class FaultRig(Rig):
    """`nats`: of tests/worlds. Towers are numbered 0 and 1, and keep their ports."""

    def __init__(self, folder: Path, postgres: FaultyPostgres, nats: Any, ports: tuple[int, int]) -> None:
        super().__init__(folder, KIND, None)
        self.postgres = postgres
        self.nats = nats
        self.ports = ports
        self._udp_ports = (free_udp_port(), free_udp_port())
        self._number = 0
        self.towers: list[asyncio.subprocess.Process | None] = [None, None]
        self._people: dict[tuple[str, int], Person] = {}

    @property
    def _environment(self) -> dict[str, str]:
        port = self.ports[self._number]
        return super()._environment | {
            "DATABASE_URL": self.postgres.url,
            "TOWER_BUS_URL": self.nats.url,
            "TOWER_PORT": str(port),
            "TOWER_UDP_PORT": str(self._udp_ports[self._number]),
            "TOWER_OWN_URL": f"http://127.0.0.1:{port}",
        }

    def address_of(self, number: int) -> str:
        return f"http://127.0.0.1:{self.ports[number]}"

    async def start(self) -> None:
        await self._tower_command("migrate")
        for name, role in (("admin", "admin"), ("operator", "operator")):
            words = ("user", "add", name, "--role", role, "--password-stdin", "--for-good")
            await self._tower_command(*words, stdin=PASSWORD)
        token = str(self._folder / "drone.token")
        await self._tower_command("drone", "add", "Kestrel", "--owner", "operator", "--token-file", token)
        for number in (0, 1):
            await self.start_tower_number(number)
        await self._start_drone(self.address_of(0), token)
        self.operator = await self.person("operator", 1)
        await self.operator.go_live()
        await wait_for("the drone to be online", self._online)

    async def _online(self) -> bool:
        with contextlib.suppress(*GONE):
            drone = await self.operator.drone()
            return bool(drone["online"] and drone["autopilot_heard"])
        return False

    async def _serve(self, number: int) -> None:
        self._number = number
        self._starts += 1
        self.towers[number] = await self._run(f"tower-{self._starts}", str(BIN / "tower"), "serve")

    async def start_tower_number(self, number: int) -> None:
        """Also after its end. Returns when it is ready."""
        await self._serve(number)
        address = self.address_of(number)
        async with httpx.AsyncClient(base_url=address, trust_env=False) as client:

            async def ready() -> bool:
                if self.process(number).returncode is not None:  # something else has its port for a moment
                    await asyncio.sleep(START_AGAIN_S)
                    await self._serve(number)
                with contextlib.suppress(httpx.HTTPError):
                    return (await client.get("/api/v1/health/ready")).status_code == 200
                return False

            await wait_for(f"the tower at {address}", ready)

    async def drain(self, number: int) -> None:
        """Returns when the tower has left the others."""
        await self._tower_command("drain", self.address_of(number))

    def process(self, number: int) -> asyncio.subprocess.Process:
        process = self.towers[number]
        assert process is not None
        return process

    async def home(self) -> int:
        """The tower that has the drone, as the database says."""
        connection = await asyncpg.connect(self.postgres.url)
        try:
            url = await connection.fetchval(
                "SELECT url FROM tower_members JOIN drone_homes USING (tower) WHERE drone_id = 1"
            )
        finally:
            await connection.close()
        return [self.address_of(0), self.address_of(1)].index(url)

    async def lease(self) -> tuple[int, str | None]:
        """Epoch and holder, as the database says."""
        connection = await asyncpg.connect(self.postgres.url)
        try:
            row = await connection.fetchrow(
                "SELECT epoch, name FROM control_leases LEFT JOIN users ON users.id = holder_id WHERE drone_id = 1"
            )
        finally:
            await connection.close()
        return (row[0], row[1]) if row is not None else (0, None)

    async def person(self, name: str, number: int) -> Person:
        """Somebody at a tower, signed in once for good."""
        person = self._people.get((name, number))
        if person is None:
            mark = OPERATOR if name == "operator" else ADMIN
            person = Person(name, mark, self.address_of(number), 1)
            await person.sign_in(PASSWORD)
            self._people[name, number] = person
        return person

    def linked_times(self) -> int:
        log = self._folder / "agent.log"
        return len(re.findall(r"link up:", log.read_text(errors="replace")))

    async def stop(self) -> None:
        for person in self._people.values():
            with contextlib.suppress(*GONE):
                await person.close()
        self._people.clear()
        for name in ("operator", "admin"):
            if hasattr(self, name):
                delattr(self, name)
        await super().stop()


class Flyer:
    """Somebody who flies by hand for the whole round: connects again, at the other tower too, when a socket ends."""

    def __init__(self, rig: FaultRig, name: str, number: int) -> None:
        self._rig = rig
        self._name = name
        self.number = number
        self.person: Person
        self._task: asyncio.Task[None] | None = None

    async def begin(self) -> None:
        self.person = await self._rig.person(self._name, self.number)
        await self.person.vanish()
        await self.person.go_live()
        self.person.sticks = Sticks()
        self._task = asyncio.create_task(self._stay())

    async def _stay(self) -> None:
        """As the console does: another tower if this one is silent for 1.5 s or has closed the connection."""
        while True:
            await asyncio.sleep(LOOK_AGAIN_S)
            if self.person.is_live(1.5):
                continue
            for number in (self.number, 1 - self.number):
                with contextlib.suppress(*GONE):
                    await self.person.vanish()
                    other = await self._rig.person(self._name, number)
                    async with asyncio.timeout(2):
                        await other.go_live()
                    other.sticks = Sticks()
                    self.person, self.number = other, number
                    break

    async def end(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        self.person.sticks = None
        await self.person.vanish()


@contextlib.asynccontextmanager
async def fault_rig(
    folder: Path, postgres: FaultyPostgres, nats: Any, ports: tuple[int, int]
) -> AsyncIterator[FaultRig]:
    folder.mkdir(parents=True)  # noqa: ASYNC240 (once, before anything runs)
    rig = FaultRig(folder, postgres, nats, ports)
    try:
        await rig.start()
        yield rig
    finally:
        await asyncio.shield(rig.stop())
