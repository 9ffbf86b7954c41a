"""Every route while the database is locked, frozen or killed: a response in time, with a message, and no late
effects."""

import asyncio
import sqlite3
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

import httpx
import pytest
from control_world import until
from every_route import BODIES, ROUTES, path_of
from own_postgres import OwnPostgres, own_postgres
from sqlalchemy import select
from tower_world import TowerWorld, assert_problem, start_tower

from server.kernel.people import Role
from server.storage.tables import METADATA

TIMEOUT_S: Final = 1.5
SLACK_S: Final = 1.3
"""For the work beside the database on a busy machine. Twice the timeout is more than both."""
STARTS_A_PROCESS: Final = {"import_flight"}
"""It converts the file before it asks the database: how long a process takes to start says nothing of that."""
AT_ONCE: Final = 6
TICK_S: Final = 0.02
SKIPPED: Final = {"sign_out", "who_is_online"}
"""The first ends the sign-in that the other requests use."""
ON_ITS_OWN: Final = {
    "audit_events",
    "audit_chain",
    "audit_chain_state",
    "audit_heads",
    "tower_lock",
    "sessions",
    "api_tokens",
    "user_addresses",
    "known_addresses",
}
"""Tables that the tower itself writes when the database is back: refusals, and when users were last seen."""


class Asked:
    """Requests to all routes by an admin while the database fails."""

    def __init__(self) -> None:
        self.answers: dict[str, tuple[httpx.Response, float]] = {}
        self.stalled_s = 0.0
        """Total time in which the event loop, which the tower shares with this test, did not run."""

    async def ask(self, client: httpx.AsyncClient, drone_id: int) -> None:
        waiting = [route for route in ROUTES if route.name not in SKIPPED]

        async def measure_stalls() -> None:
            while True:
                began = time.monotonic()
                await asyncio.sleep(TICK_S)
                self.stalled_s += max(0.0, time.monotonic() - began - 2 * TICK_S)

        async def some() -> None:
            while waiting:
                route = waiting.pop(0)
                method, path = next(iter(route.methods)), path_of(route, drone_id)
                began, stalled_s = time.monotonic(), self.stalled_s
                try:
                    answer = await client.request(method, path, json=BODIES.get(route.name), timeout=60)
                except httpx.RemoteProtocolError as error:
                    answer = httpx.Response(500, text=str(error))
                self.answers[route.name] = answer, time.monotonic() - began - (self.stalled_s - stalled_s)

        measuring = asyncio.create_task(measure_stalls())
        try:
            await asyncio.gather(*(some() for _ in range(AT_ONCE)))
        finally:
            measuring.cancel()

    def check(self) -> None:
        bad: list[tuple[str, int, float, str]] = []
        refused = 0
        for name, (answer, took_s) in self.answers.items():
            if answer.status_code == 503 and answer.json()["type"] == "/problems/database-unavailable":
                refused += 1
                assert assert_problem(answer, 503, "database-unavailable")["detail"]
            is_late = took_s > TIMEOUT_S + SLACK_S and name not in STARTS_A_PROCESS
            if answer.status_code == 500 or is_late:
                bad.append((name, answer.status_code, round(took_s, 2), answer.text[:100]))
        slowest_s = max(took for _, took in self.answers.values())
        print(
            f"{refused} refused, the slowest after {slowest_s:.2f} s; the loop stood still for {self.stalled_s:.2f} s"
        )
        for one in bad:
            print("BAD", one)
        assert bad == []
        assert refused > 10, "the database did not fail"


async def contents(world: TowerWorld) -> dict[str, list[Any]]:
    found = {}
    async with world.database.reading() as session:
        for table in METADATA.sorted_tables:
            if table.name not in ON_ITS_OWN:
                found[table.name] = sorted(map(repr, (await session.execute(select(table))).all()))
    return found


@asynccontextmanager
async def walking(
    tmp_path: Path, *, comes_back: bool = True, **settings: Any
) -> AsyncIterator[Callable[[], Awaitable[TowerWorld]]]:
    """Yields a function that requests all routes."""
    async with start_tower(tmp_path, database_timeout_s=TIMEOUT_S, **settings) as world:
        alice = await world.add_user("Alice")
        drone = await world.add_drone("Kestrel", alice)
        client = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        assert (await client.get("/api/v1/me")).status_code == 200
        before = await contents(world)

        async def walk() -> TowerWorld:
            asked = Asked()
            await asked.ask(client, drone.id)
            asked.check()
            return world

        yield walk
        if comes_back:
            assert await contents(world) == before, "something was carried out late"


async def test_locked(tmp_path: Path) -> None:
    async with walking(tmp_path) as walk:
        other = sqlite3.connect(tmp_path / "var" / "tower.sqlite3", isolation_level=None, timeout=30)
        try:
            other.execute("BEGIN IMMEDIATE")
            world = await walk()
            other.execute("ROLLBACK")
        finally:
            other.close()
        await until("a renewal", lambda: world.tower.lock.is_renewed)


@pytest.fixture
def postgres(missing: Callable[[str], None]) -> Iterator[OwnPostgres]:
    with own_postgres(missing) as found:
        yield found


@pytest.mark.parametrize("how", ["frozen", "killed"])
async def test_postgres(tmp_path: Path, postgres: OwnPostgres, how: str) -> None:
    url = postgres.url.replace("postgresql://", "postgresql+asyncpg://")
    async with walking(tmp_path, comes_back=how == "frozen", database_url=url) as walk:
        postgres.freeze() if how == "frozen" else postgres.kill()
        world = await walk()
        if how == "frozen":
            postgres.thaw()
            await until("a renewal", lambda: world.tower.lock.is_renewed)
