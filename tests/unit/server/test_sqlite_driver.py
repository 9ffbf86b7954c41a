"""Statements of SQLite's connections, each one trip to their thread."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

import pytest
import pytest_asyncio
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from server.storage.database import Database, open_database
from server.storage.sqlite_driver import ROWS_AT_ONCE, OneTripConnection

NUMBERS: Final = (
    "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < :most) SELECT i FROM n ORDER BY i"
)
AROUND_A_BATCH: Final = [1, ROWS_AT_ONCE - 1, ROWS_AT_ONCE, ROWS_AT_ONCE + 1, 3 * ROWS_AT_ONCE]


@pytest_asyncio.fixture
async def database(tmp_path: Path) -> AsyncIterator[Database]:
    opened = open_database(f"sqlite+aiosqlite:///{tmp_path}/driver.sqlite3")
    async with opened.writing() as session:
        await session.execute(text("CREATE TABLE things (id INTEGER PRIMARY KEY, name TEXT UNIQUE)"))
    yield opened
    await opened.close()


@pytest.mark.parametrize("most", AROUND_A_BATCH)
async def test_every_row_comes_however_many_there_are(database: Database, most: int) -> None:
    async with database.reading() as session:
        assert list(await session.scalars(text(NUMBERS), {"most": most})) == list(range(1, most + 1))


@pytest.mark.parametrize("most", AROUND_A_BATCH)
async def test_a_stream_gives_every_row_in_order(database: Database, most: int) -> None:
    async with database.reading() as session:
        rows = await session.stream_scalars(text(NUMBERS).execution_options(yield_per=200), {"most": most})
        assert [one async for one in rows] == list(range(1, most + 1))


async def test_a_stream_that_is_left_early_keeps_no_lock(database: Database) -> None:
    async with database.reading() as session:
        rows = await session.stream_scalars(text(NUMBERS).execution_options(yield_per=10), {"most": 5 * ROWS_AT_ONCE})
        assert await anext(aiter(rows)) == 1
        await rows.close()
    async with database.writing() as session:
        await session.execute(text("INSERT INTO things (name) VALUES ('after')"))
    async with database.reading() as session:
        assert await session.scalar(text("SELECT name FROM things")) == "after"


async def test_writes_tell_how_many_rows_they_changed_and_what_they_return(database: Database) -> None:
    async with database.writing() as session:
        await session.execute(
            text("INSERT INTO things (name) VALUES (:name)"), [{"name": f"thing {n}"} for n in range(5)]
        )
        changed = await session.execute(text("UPDATE things SET name = name || '!' WHERE id > 2"))
        assert changed.rowcount == 3  # type: ignore[attr-defined]
        returned = await session.scalars(text("DELETE FROM things WHERE id = 5 RETURNING name"))
        assert list(returned) == ["thing 4!"]


async def test_an_error_leaves_a_connection_that_works(database: Database) -> None:
    async with database.writing() as session:
        await session.execute(text("INSERT INTO things (name) VALUES ('one')"))
    with pytest.raises(IntegrityError):
        async with database.writing() as session:
            await session.execute(text("INSERT INTO things (name) VALUES ('one')"))
    async with database.writing() as session:
        assert await session.scalar(text("SELECT count(*) FROM things")) == 1


async def test_a_statement_is_one_trip(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    trips = []
    run = OneTripConnection.run

    async def counted(self: OneTripConnection, function: Any, *words: Any) -> Any:
        trips.append(words[0])
        return await run(self, function, *words)

    monkeypatch.setattr(OneTripConnection, "run", counted)
    async with database.reading() as session:
        assert await session.scalar(text("SELECT count(*) FROM things")) == 0
    assert trips == ["BEGIN", "SELECT count(*) FROM things"]
