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
from server.vault import Vault


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


async def test_postgres_up_down_up(postgres_url: str, tmp_path: Path) -> None:
    database = open_database(postgres_url.replace("postgresql://", "postgresql+asyncpg://"))
    try:
        await _up_down_up(database)
        await migrate(database, "base")
        await _second_factors_are_sealed_and_opened(database, Vault(key_file=tmp_path / "secret.key"))
    finally:
        await database.close()


SECRETS = {"totp_secret": "JBSWY3DPEHPK3PXPJBSWY3DPEHPK3PXP", "totp_pending": "KRSXG5CTMVRXEZLUKRSXG5CTMVRXEZLU"}


async def _second_factors_are_sealed_and_opened(database: Database, vault: Vault) -> None:
    """Up to 0006 and down again, of a database that holds them in the clear."""
    await migrate(database, "0005")
    async with database.writing() as session:
        for name in ("anna", "ben"):
            secret, pending = (f"'{value}'" if name == "anna" else "NULL" for value in SECRETS.values())
            await session.execute(
                text(
                    "INSERT INTO users (name, name_key, password_hash, role, created_at, totp_secret, totp_pending) "
                    f"VALUES ('{name}', '{name}', 'x', 'operator', '2026-01-01 00:00:00', {secret}, {pending})"
                )
            )
    await migrate(database, "0006", vault=vault)
    async with database.reading() as session:
        rows = (await session.execute(text("SELECT id, totp_sealed, totp_pending_sealed FROM users ORDER BY id"))).all()
    (anna, *sealed), (_, *none) = rows
    assert none == [None, None]
    about = f"second factor of user {anna}"
    assert [vault.open(one, about=about) for one in sealed] == list(SECRETS.values())
    assert not any(secret in str(rows) for secret in SECRETS.values())
    await migrate(database, "0005", vault=vault)
    async with database.reading() as session:
        found = (await session.execute(text("SELECT totp_secret, totp_pending FROM users WHERE name = 'anna'"))).one()
    assert list(found) == list(SECRETS.values())
    await migrate(database, vault=vault)
    await check_schema(database)


async def test_second_factors_in_the_clear_are_sealed_and_leave_no_trace(sqlite: Database, tmp_path: Path) -> None:
    key_file = tmp_path / "keys" / "secret.key"
    await _second_factors_are_sealed_and_opened(sqlite, Vault(key_file=key_file))
    assert key_file.stat().st_mode & 0o777 == 0o600
    await sqlite.close()
    files = (tmp_path / f"tower.sqlite3{ending}" for ending in ("", "-wal", "-shm"))
    left = b"".join(one.read_bytes() for one in files if one.exists())
    assert b"anna" in left
    assert not any(secret.encode() in left for secret in SECRETS.values())
