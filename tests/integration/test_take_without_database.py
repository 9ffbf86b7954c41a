"""An admin takes control while the database is locked, full, frozen or killed: the drone holds at once, the old
holder is locked out until the decision, both are notified, and nothing takes effect late."""

import asyncio
import sqlite3
import subprocess
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import Live, ObedientAgent, ask, audit, live, until
from own_postgres import OwnPostgres, own_postgres
from prometheus_client.parser import text_string_to_metric_families
from sqlalchemy import event
from tower_world import NewDrone, Person, TowerWorld, assert_problem, start_tower

from server.control.core.lease import Event
from server.kernel.people import Role
from server.towers.core.tower_lease import LEASE_S
from wire.ids import DroneId

DATABASE_GIVEN_UP_S = 15.0
"""From the request to the order. 0.1 s is the wait for the database; the rest allows for a busy machine."""
TIMEOUT_S = 2.0
SECRET = "a-secret-for-reading-metrics"


class Scene:
    """Alice flies a drone by hand, and an admin is signed in; both have live connections."""

    def __init__(self, world: TowerWorld) -> None:
        self.world = world

    async def begin(self, stack: AsyncExitStack) -> "Scene":
        world = self.world
        root: Person = await world.add_user("Root", Role.ADMIN)
        alice = await world.add_user("Alice")
        self.drone: NewDrone = await world.add_drone("Kestrel", alice)
        self.root, self.alice = await world.signed_in(root), await world.signed_in(alice)
        self.roots: Live = await stack.enter_async_context(live(world, self.root))
        self.alices: Live = await stack.enter_async_context(live(world, self.alice))
        self.agent = ObedientAgent(world.tower.hub, self.drone.id)
        self.agent.state(armed=True, airborne=True)
        assert (await ask(self.alice, self.drone.id, "acquire")).status_code == 200
        assert (await self.root.get("/api/v1/me")).status_code == 200
        await until("a renewal", lambda: world.tower.lock.is_renewed)
        return self

    @property
    def lease(self) -> Any:
        drone = self.world.tower.hub.state.drones.get(DroneId(self.drone.id))
        assert drone is not None
        return drone

    async def take_fails(self, *, within_s: float = 30.0, fails_at_once: bool = False) -> httpx.Response:
        """Sends the take, and checks the conditions before and after its response."""
        holds, epoch = len(self.agent.holds), self.lease.lease.epoch
        began = time.monotonic()
        asked = asyncio.create_task(ask(self.root, self.drone.id, "take", reason="low"))
        await until("the order to hold", lambda: len(self.agent.holds) > holds)
        ordered_s = time.monotonic() - began
        assert fails_at_once or not asked.done(), "before the database is given up"
        assert self.lease.fenced
        answer = await asyncio.wait_for(asked, within_s)
        print(f"hold ordered after {ordered_s * 1000:.0f} ms, answered after {time.monotonic() - began:.2f} s")
        said = assert_problem(answer, 503, "database-unavailable")
        assert "nobody's commands pass" in said["detail"]
        assert self.lease.fenced, "the old holder is shut out until it is decided"
        assert self.lease.lease.holder.name == "Alice"
        assert self.lease.lease.epoch == epoch
        for who in (self.roots, self.alices):
            reported = await who.event("notice", code="control-undecided")
            assert "Root takes control" in reported["text"]
            await who.event("hold", step="ordered")
        return answer

    async def comes_back(self) -> None:
        """The database responds again: the take did not take effect late, and a new one succeeds."""
        await until("the decision", lambda: not self.lease.fenced)
        for who in (self.roots, self.alices):
            reported = await who.event("notice", code="control-undecided")
            assert reported["text"] == "The database answers again: Alice has the controls."
        await until("a renewal", lambda: self.world.tower.lock.is_renewed)
        # Connections that broke are replaced; no event tells when.
        while (await self.root.get("/api/v1/audit?limit=1")).status_code == 503:  # noqa: ASYNC110
            await asyncio.sleep(0.05)
        trail = await audit(self.root, "control.take")
        assert [one["detail"]["result"] for one in trail] == ["failed"]
        drone = (await self.root.get(f"/api/v1/drones/{self.drone.id}")).json()
        assert drone["holder"]["name"] == "Alice"
        assert (await ask(self.root, self.drone.id, "take")).status_code == 200
        assert self.lease.lease.holder.name == "Root"

    async def is_alive_and_not_ready(self) -> None:
        stranger = await self.world.client()
        lock = self.world.tower.lock
        await until("the failed renewal", lambda: not lock.is_renewed)
        assert (await stranger.get("/api/v1/health")).json()["status"] == "ok"
        assert_problem(await stranger.get("/api/v1/health/ready"), 503, "database-unavailable")
        assert lock.may_act(), "nobody can take what cannot be written: it stays the tower"
        me = await self.alice.post(f"/api/v1/drones/{self.drone.id}/control/keep-alive")
        assert me.status_code == 200, "who flies goes on flying"

    async def metrics(self) -> dict[str, float]:
        """Read with the metrics token, which needs no database."""
        reader = await self.world.client(headers={"Authorization": f"Bearer {SECRET}"})
        text = (await reader.get("/metrics")).text
        return {one.name: one.value for family in text_string_to_metric_families(text) for one in family.samples}

    async def until_no_write_passes(self, filler: Path) -> None:
        """A log that has grown before is written again from its beginning: it takes some more writes."""
        lock = self.world.tower.lock
        deadline = time.monotonic() + 30
        while lock.is_renewed:
            assert time.monotonic() < deadline
            await asyncio.to_thread(_fill, filler)
            await asyncio.sleep(0.1)


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path, database_timeout_s=TIMEOUT_S) as world, AsyncExitStack() as stack:
        yield await Scene(world).begin(stack)


async def test_locked(scene: Scene) -> None:
    stranger = await scene.world.client()
    assert (await stranger.get("/api/v1/health/ready")).status_code == 200
    other = sqlite3.connect(scene.world.settings.var / "tower.sqlite3", isolation_level=None)
    try:
        other.execute("BEGIN EXCLUSIVE")
        await scene.take_fails(within_s=30)
        await scene.is_alive_and_not_ready()
        other.execute("ROLLBACK")
    finally:
        other.close()
    await scene.comes_back()


async def test_a_request_that_is_cut_off_leaves_the_fence(scene: Scene) -> None:
    """Until the database has responded, it is unknown who has the controls."""
    world, hub = scene.world, scene.world.tower.hub
    roots = next(one.viewer for one in hub.state.browsers.values() if one.viewer.role is Role.ADMIN)
    other = sqlite3.connect(world.settings.var / "tower.sqlite3", isolation_level=None)
    try:
        other.execute("BEGIN EXCLUSIVE")
        holds = len(scene.agent.holds)
        asked = asyncio.create_task(
            world.tower.control.change(
                roots, DroneId(scene.drone.id), Event.TAKE, reason="low", address="", now=time.monotonic()
            )
        )
        await until("the order to hold", lambda: len(scene.agent.holds) > holds)
        asked.cancel()
        await asyncio.wait({asked})
        assert asked.cancelled()
        assert scene.lease.fenced
        for who in (scene.roots, scene.alices):
            assert "Root takes control" in (await who.event("notice", code="control-undecided"))["text"]
        other.execute("ROLLBACK")
    finally:
        other.close()
    await scene.comes_back()


async def test_full(scene: Scene) -> None:
    tower = scene.world.tower
    boss = await scene.world.signed_in(await scene.world.add_user("Boss", Role.ADMIN))
    full = True

    def no_more_pages(connection: Any, *_: Any) -> None:
        """A limit of 1 is below the current number of pages, so SQLite adds none."""
        cursor = connection.connection.cursor()
        cursor.execute(f"PRAGMA max_page_count = {1 if full else 1 << 30}")
        cursor.close()

    event.listen(tower.database.engine.sync_engine, "begin", no_more_pages)
    holds = 0
    for number in range(200):  # the last page has room for a few records: two admins take control from each other
        holds = len(scene.agent.holds)
        answer = await ask((scene.root, boss)[number % 2], scene.drone.id, "take", reason="x" * 250)
        if answer.status_code == 503:
            break
        assert answer.status_code == 200, (number, answer.text)
    else:
        pytest.fail("the database was never full")
    assert "nobody's commands pass" in assert_problem(answer, 503, "database-unavailable")["detail"]
    assert len(scene.agent.holds) > holds
    assert scene.lease.fenced
    full = False
    await until("the decision", lambda: not scene.lease.fenced)
    taker = (scene.root, boss)[number % 2]
    assert (await ask(taker, scene.drone.id, "take")).status_code == 200


@pytest.fixture
def postgres(missing: Callable[[str], None]) -> Iterator[OwnPostgres]:
    with own_postgres(missing) as found:
        yield found


async def test_frozen(tmp_path: Path, postgres: OwnPostgres) -> None:
    url = postgres.url.replace("postgresql://", "postgresql+asyncpg://")
    settings: dict[str, Any] = {"database_url": url, "database_timeout_s": TIMEOUT_S}
    async with start_tower(tmp_path, **settings) as world, AsyncExitStack() as stack:
        scene = await Scene(world).begin(stack)
        postgres.freeze()
        await scene.take_fails(within_s=30)
        await scene.is_alive_and_not_ready()
        # Longer than the lease and two attempts: the tower keeps its lock without a gap.
        gaps, looked_until = 0, time.monotonic() + 2 * LEASE_S
        while time.monotonic() < looked_until:
            gaps += not world.tower.lock.may_act()
            await asyncio.sleep(0.02)
        assert gaps == 0
        postgres.thaw()
        await scene.comes_back()


async def test_killed(tmp_path: Path, postgres: OwnPostgres) -> None:
    url = postgres.url.replace("postgresql://", "postgresql+asyncpg://")
    settings: dict[str, Any] = {"database_url": url, "database_timeout_s": TIMEOUT_S, "metrics_token": SECRET}
    async with start_tower(tmp_path, **settings) as world, AsyncExitStack() as stack:
        scene = await Scene(world).begin(stack)
        postgres.kill()
        await scene.take_fails(fails_at_once=True)
        await scene.is_alive_and_not_ready()
        metrics = await scene.metrics()
        assert metrics["tower_database_writable"] == 0
        assert metrics["tower_database_failing"] == 1


@pytest.fixture
def small_disk(tmp_path: Path, missing: Callable[[str], None]) -> Iterator[Path]:
    """A file system of its own with 6 MB."""
    folder = tmp_path / "var"
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=6m", "tower-test", folder], check=False)
    if mounted.returncode:
        missing("mount of a tmpfs (root on Linux)")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", folder], check=False)


async def test_disk_full(tmp_path: Path, small_disk: Path) -> None:
    """The file system has no byte left: neither the database nor its log can grow."""
    async with (
        start_tower(tmp_path, database_timeout_s=TIMEOUT_S, metrics_token=SECRET) as world,
        AsyncExitStack() as stack,
    ):
        scene = await Scene(world).begin(stack)
        filler = small_disk / "filler"
        _fill(filler)
        await scene.until_no_write_passes(filler)
        await scene.take_fails(fails_at_once=True)
        await scene.is_alive_and_not_ready()
        metrics = await scene.metrics()
        assert metrics["tower_disk_free_bytes"] < 100_000
        assert metrics["tower_database_writable"] == 0
        filler.unlink()
        await scene.comes_back()


def _fill(path: Path) -> None:
    """Takes every byte that is left."""
    with path.open("ab", buffering=0) as file:
        for size in (65_536, 4096, 1):
            with suppress(OSError):
                while file.write(bytes(size)) == size:
                    pass


async def test_a_holder_who_is_disabled_is_shut_out_before_the_database_answers(tmp_path: Path) -> None:
    async with start_tower(tmp_path, database_timeout_s=DATABASE_GIVEN_UP_S) as world, AsyncExitStack() as stack:
        scene = await Scene(world).begin(stack)
        holds, epoch = len(scene.agent.holds), scene.lease.lease.epoch
        other = sqlite3.connect(world.settings.var / "tower.sqlite3", isolation_level=None)
        try:
            # As another process does it. From then on the tower can read and not write.
            other.execute("UPDATE users SET disabled = 1 WHERE name = 'Alice'")
            other.execute("UPDATE fleet_revision SET revision = revision + 1")
            other.execute("BEGIN IMMEDIATE")
            await until("the fence", lambda: scene.lease.fenced)
            began = time.monotonic()
            await until("the order to hold", lambda: len(scene.agent.holds) > holds)
            assert time.monotonic() - began < DATABASE_GIVEN_UP_S
            assert scene.lease.lease.epoch == epoch, "the database has decided nothing"
            reported = await scene.roots.event("notice", code="control-undecided")
            assert "the holder may not fly" in reported["text"]
            other.execute("ROLLBACK")
        finally:
            other.close()
        await until("the end of the lease", lambda: scene.lease.lease.holder is None)
        await until("the fence is lifted", lambda: not scene.lease.fenced)
        assert await audit(scene.root, "control.revoke")
