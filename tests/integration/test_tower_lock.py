"""The lock itself on both databases: refused, taken from a stopped owner, and what that owner may still do."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Iterator
from itertools import count
from pathlib import Path

import pytest
from control_world import until
from tower_world import copy_empty_database

from server.kernel.clock import utc_now
from server.storage.database import Database, LockLost, open_database
from server.towers.core.tower_lease import (
    AWAY_S,
    LEASE_S,
    RENEW_EVERY_S,
    RENEW_WITHIN_S,
    TAKE_AFTER_S,
    LockState,
)
from server.towers.store.tower_lock import TowerLock, TowerLockHeld


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "sqlite":
        copy_empty_database(tmp_path / "tower.sqlite3")
        return f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}"
    return str(request.getfixturevalue("migrated_postgres_url")).replace("postgresql://", "postgresql+asyncpg://")


@pytest.fixture
async def database(url: str) -> AsyncIterator[Database]:
    opened = open_database(url)
    yield opened
    await opened.close()


def fast_clock() -> Callable[[], float]:
    """Advances a second at each call."""
    seconds: Iterator[int] = count(1000)
    return lambda: float(next(seconds))


def new_lock(database: Database, now: Callable[[], float] | None = None) -> TowerLock:
    url = database.engine.url.render_as_string(hide_password=False)
    lock = TowerLock(url, clock=utc_now, now=now) if now else TowerLock(url, clock=utc_now)
    lock.address = "http://tower.example"
    return lock


async def test_the_next_one_is_refused_until_the_first_has_released_it(database: Database) -> None:
    first, second = new_lock(database), new_lock(database)
    try:
        await first.take(waits=False)
        state = await second._read()
        assert (state.owner, state.address) == (first._owner, "http://tower.example")
        original = second._read

        async def look() -> LockState:
            await first._renew_once()
            return await original()

        second._read = look  # type: ignore[method-assign]
        with pytest.raises(TowerLockHeld, match="--standby"):
            await second.take(waits=False)
        second._read = original  # type: ignore[method-assign]
        await first.release()
        await second.take(waits=False)
        assert second.may_act()
        assert not first.may_act()
    finally:
        await first.release()
        await second.release()


async def test_an_owner_that_was_stopped_writes_nothing_and_knows_it_with_its_next_look(database: Database) -> None:
    first, second = new_lock(database), new_lock(database, fast_clock())
    database.guard = first.check
    reported: list[str] = []
    first.on_lost = reported.append
    try:
        await first.take(waits=False)
        async with database.writing():
            pass
        await second.take(waits=True)  # after TAKE_AFTER_S of its own clock without a renewal
        with pytest.raises(LockLost):
            async with database.writing():
                pytest.fail("a tower that is none any more has written")
        assert not first.may_act()
        assert len(reported) == 1
        assert "another process has become the tower" in reported[0]
        assert not await first._renew_once()
        assert len(reported) == 1
        async with database.reading() as session:
            assert session is not None  # reads continue
        database.guard = second.check
        async with database.writing():
            pass
    finally:
        database.guard = None
        await first.release()
        state = await second._read()
        assert state.owner == second._owner, "who lost it releases nothing"
        await second.release()


async def test_a_tower_that_is_cut_off_holds_and_stops_before_another_takes_over(database: Database) -> None:
    first, second = new_lock(database), new_lock(database)
    held_at: list[float] = []

    async def cut_off() -> int:
        raise OSError("no route to the database")

    await first.take(waits=False)
    first.on_running_out = lambda: held_at.append(time.monotonic())
    keeping, taking = asyncio.create_task(first.keep()), asyncio.create_task(second.take(waits=True))
    try:
        await until("the first to know of the second", lambda: first._belief is not None and first._belief.is_watched)
        assert not held_at
        first._write_renewal = cut_off  # type: ignore[method-assign]
        cut_at, stopped_at = time.monotonic(), 0.0
        while not second.may_act():
            if not stopped_at and not first.may_act():
                stopped_at = time.monotonic()
            await asyncio.sleep(0.01)
        took_s = time.monotonic() - cut_at
        assert not first.may_act()
        print(f"held after {held_at[0] - cut_at:.2f} s, stopped {stopped_at - cut_at:.2f} s, taken over {took_s:.2f} s")
        assert len(held_at) == 1
        assert held_at[0] + 0.5 < stopped_at < cut_at + took_s
        assert took_s < 30.0
    finally:
        keeping.cancel()
        taking.cancel()
        await asyncio.gather(keeping, taking, return_exceptions=True)
        await first.release()
        await second.release()


def test_the_times_fit_together() -> None:
    assert LEASE_S < TAKE_AFTER_S < 5.0
    # A renewal that fails late, the pause, and a second late failure fit within the lease.
    assert 2 * RENEW_WITHIN_S + RENEW_EVERY_S < LEASE_S


async def test_after_a_pause_a_lone_tower_waits_for_its_next_renewal(database: Database) -> None:
    ahead_s = 0.0
    lock = new_lock(database, lambda: time.monotonic() + ahead_s)
    await lock.take(waits=False)
    assert await lock.confirmed()
    ahead_s += LEASE_S + 1.0  # stopped, or without a processor
    assert not lock.may_act()
    waiting = asyncio.create_task(lock.confirmed())
    keeping = asyncio.create_task(lock.keep())
    try:
        assert await waiting
        assert lock.may_act()
    finally:
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)
        await lock.release()


async def test_with_another_that_waits_for_the_lock_nothing_waits_for_a_renewal(database: Database) -> None:
    ahead_s = 0.0
    lock, other = new_lock(database, lambda: time.monotonic() + ahead_s), new_lock(database)
    await lock.take(waits=False)
    try:
        await lock._renew_once()
        await other._say_that_it_waits()
        await lock._renew_once()
        ahead_s += LEASE_S + 0.1
        lock._attempted.wait = pytest.fail  # type: ignore[method-assign, assignment]
        assert not await lock.confirmed()
    finally:
        await lock.release()
        await other.release()


async def test_after_a_long_pause_requests_are_refused_at_once(database: Database) -> None:
    ahead_s = 0.0
    lock = new_lock(database, lambda: time.monotonic() + ahead_s)
    await lock.take(waits=False)
    try:
        ahead_s += AWAY_S + 0.1
        lock._attempted.wait = pytest.fail  # type: ignore[method-assign, assignment]
        assert not await lock.confirmed()
        await lock._renew_once()
        assert await lock.confirmed()
    finally:
        await lock.release()
