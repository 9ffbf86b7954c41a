"""Migrations on real databases: up, down and up again, and the tables they make are those that the code expects."""

from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import Connection, inspect, text

from server.database import Database, open_database
from server.fleet.snapshot import load_snapshot
from server.schema import DatabaseNotReady, check_schema, migrate
from server.tables import METADATA


def _difference(connection: Connection) -> list[object]:
    return list(compare_metadata(MigrationContext.configure(connection), METADATA))


def _tables(connection: Connection) -> set[str]:
    return set(inspect(connection).get_table_names()) - {"alembic_version"}


async def _up_down_up(database: Database) -> None:
    await migrate(database)
    await check_schema(database)
    async with database.engine.connect() as connection:
        assert await connection.run_sync(_difference) == []
        assert await connection.run_sync(_tables) == set(METADATA.tables)
    await migrate(database, "base")
    async with database.engine.connect() as connection:
        assert await connection.run_sync(_tables) == set()
    with pytest.raises(DatabaseNotReady, match="empty: run `tower migrate`"):
        await check_schema(database)
    await migrate(database)
    await check_schema(database)
    async with database.reading() as session:
        snapshot = await load_snapshot(session)
    assert (snapshot.revision, snapshot.drones) == (0, ())


@pytest.fixture
async def sqlite(tmp_path: Path):
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}")
    yield database
    await database.close()


async def test_sqlite_up_down_up(sqlite: Database) -> None:
    await _up_down_up(sqlite)


async def test_sqlite_is_set_up_as_promised(sqlite: Database) -> None:
    async with sqlite.engine.connect() as connection:
        found = {}
        for pragma in ("journal_mode", "foreign_keys", "busy_timeout"):
            found[pragma] = (await connection.execute(text(f"PRAGMA {pragma}"))).scalar()
    assert found == {"journal_mode": "wal", "foreign_keys": 1, "busy_timeout": 5000}


async def test_a_database_of_a_newer_version_is_left_alone(sqlite: Database) -> None:
    await migrate(sqlite)
    async with sqlite.writing() as session:
        await session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(DatabaseNotReady, match="newer version"):
        await check_schema(sqlite)


async def test_postgres_up_down_up(postgres_url: str) -> None:
    database = open_database(postgres_url.replace("postgresql://", "postgresql+asyncpg://"))
    try:
        await _up_down_up(database)
    finally:
        await database.close()
