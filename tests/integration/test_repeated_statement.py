"""Statements that the tower repeats: on both databases, after lost connections, and beside one that hangs."""

import asyncio
from collections.abc import AsyncIterator
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
from control_world import until
from sqlalchemy import BigInteger, Column, MetaData, String, Table, bindparam, event, select, text
from sqlalchemy.exc import DBAPIError

from server.storage.database import Database, DatabaseUnavailable, UtcDateTime, open_database, sqlite_file
from server.storage.sqlite_driver import OneTripConnection

NOW = datetime(2026, 11, 25, 14, 0, 0, 250_000, tzinfo=UTC)
VISITS = Table(
    "visits",
    MetaData(),
    Column("name", String(20), primary_key=True),
    Column("times", BigInteger),
    Column("at", UtcDateTime),
)
VISIT = (
    VISITS.update()
    .where(VISITS.c.name == bindparam("who"))
    .values(times=VISITS.c.times + 1, at=bindparam("now"))
    .returning(VISITS.c.times)
)


@pytest.fixture(params=["sqlite", "postgresql"])
async def database(request: pytest.FixtureRequest, tmp_path: Path) -> AsyncIterator[Database]:
    if request.param == "sqlite":
        url = f"sqlite+aiosqlite:///{tmp_path / 'visits.sqlite3'}"
    else:
        url = (await asyncio.to_thread(request.getfixturevalue, "postgres_url")).replace("://", "+asyncpg://")
    opened = open_database(url, timeout_s=0.5)
    async with opened.writing() as session:
        await session.run_sync(lambda one: VISITS.metadata.create_all(one.connection()))
        await session.execute(VISITS.insert().values(name="Mia", times=0))
    yield opened
    await opened.close()


async def stored(database: Database) -> tuple[int, datetime]:
    async with database.reading() as session:
        times, at = (await session.execute(select(VISITS.c.times, VISITS.c.at))).one()
    return times, at


async def test_each_call_is_committed_and_returns_its_value(database: Database) -> None:
    visit = database.repeated(VISIT)
    here = NOW.astimezone(timezone(timedelta(hours=5)))
    assert [await visit.scalar(who="Mia", now=one) for one in (NOW, NOW, here)] == [1, 2, 3]
    assert await visit.scalar(who="nobody", now=NOW) is None
    assert await stored(database) == (3, NOW)
    assert await database.ask(database.repeated(select(VISITS.c.times))) == 3
    assert database.answers.transactions == 3  # the fixture's, `stored`, `ask`


async def test_each_call_is_one_trip_to_sqlite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trips: list[str] = []
    run = OneTripConnection.run

    async def counted(self: OneTripConnection, function: Any, *arguments: Any) -> Any:
        trips.append(function.__name__)
        return await run(self, function, *arguments)

    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'visits.sqlite3'}")
    async with database.writing() as session:
        await session.run_sync(lambda one: VISITS.metadata.create_all(one.connection()))
    visit = database.repeated(VISIT)
    await visit.scalar(who="Mia", now=NOW)
    monkeypatch.setattr(OneTripConnection, "run", counted)
    await visit.scalar(who="Mia", now=NOW)
    assert trips == ["_execute"]
    await database.close()


async def test_it_keeps_one_connection_outside_of_the_pool_and_closes_it_with_the_database(database: Database) -> None:
    visit = database.repeated(VISIT)
    opened = []
    event.listen(database.engine.sync_engine, "do_connect", lambda *_: opened.append(1))
    for _ in range(5):
        await visit.scalar(who="Mia", now=NOW)
    assert len(opened) <= 1, "the first comes from the pool"
    pool = database.pool_use()
    assert pool is None or pool.in_use == 0
    assert visit._kept is not None
    driver = visit._kept.dbapi_connection.driver_connection  # type: ignore[union-attr]
    await database.close()
    assert vars(visit)["_kept"] is None
    if database.engine.dialect.name == "sqlite":
        await until("its thread to end", lambda: not driver._thread.is_alive())
    else:
        assert driver.is_closed()


async def test_a_connection_that_has_ended_is_replaced_within_the_call(database: Database) -> None:
    visit = database.repeated(VISIT)
    assert await visit.scalar(who="Mia", now=NOW) == 1
    assert visit._kept is not None
    if database.engine.dialect.name == "sqlite":
        await visit._kept.dbapi_connection.driver_connection.close()  # type: ignore[union-attr]
    else:
        async with database.writing() as session:
            others = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database()"
            await session.execute(text(f"{others} AND pid <> pg_backend_pid()"))
    assert await visit.scalar(who="Mia", now=NOW) == 2


async def test_a_refused_statement_leaves_the_connection_in_use(database: Database) -> None:
    visit = database.repeated(VISITS.insert().values(name=bindparam("who"), times=0))
    with pytest.raises(DBAPIError) as refused:
        await visit.scalar(who="Mia")
    assert not refused.value.connection_invalidated
    kept = visit._kept
    assert kept is not None
    assert await visit.scalar(who="Ben") is None
    assert visit._kept is kept


async def test_one_that_waits_delays_no_other(database: Database) -> None:
    """Another process has the write lock: the call that waits for it is given up, and the next one is answered as soon
    as the lock is free."""
    visit = database.repeated(VISIT)
    assert await visit.scalar(who="Mia", now=NOW) == 1
    patient = open_database(database.engine.url.render_as_string(hide_password=False))
    async with patient.engine.connect() as other:
        await other.execute(text("UPDATE visits SET times = 10 WHERE name = 'Mia'"))
        waiting = asyncio.create_task(visit.scalar(who="Mia", now=NOW))
        await asyncio.sleep(0.05)
        assert not waiting.done()
        waiting.cancel()
        await asyncio.gather(waiting, return_exceptions=True)
        assert visit._kept is None
        with pytest.raises((DBAPIError, TimeoutError)):
            await visit.scalar(who="Mia", now=NOW)
        await other.commit()
    await patient.close()
    assert await visit.scalar(who="Mia", now=NOW) == 11


async def test_a_database_out_of_reach_is_unavailable(tmp_path: Path) -> None:
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'visits.sqlite3'}")
    with pytest.raises(DatabaseUnavailable, match="no such table"):
        await database.ask(database.repeated(select(VISITS.c.times)))
    await database.close()
    file = sqlite_file(database.engine.url.render_as_string())
    assert file is not None
    file.write_bytes(b"not a database" * 100)
    with pytest.raises(DBAPIError, match="not a database"):
        await database.repeated(select(VISITS.c.times)).scalar()
    await database.close()
