"""Migrations on real databases: up, down and up again, and the resulting tables match the code."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import JSON, Connection, DateTime, column, insert, inspect, select, table, text
from sqlalchemy.exc import IntegrityError

from server.accounts.store.tables import ApiTokenRow
from server.fleet.store.snapshot import load_snapshot
from server.runtime.packaged import MIGRATIONS
from server.runtime.vault import Vault
from server.storage.database import Database, open_database
from server.storage.schema import DatabaseNotReady, check_schema, is_known_revision, migrate, newest_revision
from server.storage.tables import METADATA


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


def test_file_names_tell_the_revisions() -> None:
    """The tower starts by them, because loading Alembic takes a tenth of a start."""
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    scripts = ScriptDirectory.from_config(config)
    assert newest_revision() == scripts.get_current_head()
    assert all(is_known_revision(one.revision) for one in scripts.walk_revisions())
    assert not is_known_revision("9999")


@pytest.fixture
async def sqlite(tmp_path: Path):
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}")
    yield database
    await database.close()


@pytest.mark.filterwarnings("ignore:Skipped unsupported reflection of expression-based index")
@pytest.mark.filterwarnings("ignore:autogenerate skipping metadata-specified expression-based index")
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
        await _settings_go_there_and_back(database)
        await migrate(database, "base")
        await _second_factors_are_sealed_and_opened(database, Vault(key_file=tmp_path / "secret.key"))
    finally:
        await database.close()


SECRETS = {"totp_secret": "JBSWY3DPEHPK3PXPJBSWY3DPEHPK3PXP", "totp_pending": "KRSXG5CTMVRXEZLUKRSXG5CTMVRXEZLU"}


async def _second_factors_are_sealed_and_opened(database: Database, vault: Vault) -> None:
    """Upgrades to 0006 and back, a database that holds them in the clear."""
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


async def test_channels_and_what_is_on_its_way_there_survive_web_push_and_its_removal(sqlite: Database) -> None:
    """SQLite copies the table, and deletions cascade."""
    await migrate(sqlite, "0028")
    at = "'2026-01-01 00:00:00.000000'"
    delivery = f"3, 7, 9, 'opened', '{{}}', {at}, {at}, 0, ''"
    async with sqlite.writing() as session:
        for statement in (
            "INSERT INTO users (id, name, name_key, password_hash, role, created_at)"
            f" VALUES (1, 'a', 'a', 'x', 'operator', {at})",
            "INSERT INTO alert_channels (id, user_id, kind, target, severity, drones, code_tries, created_at, problem)"
            f" VALUES (7, 1, 'mail', 'a@example.org', 'warning', 'all', 0, {at}, '')",
            "INSERT INTO alert_deliveries (id, channel_id, alert_id, happening, content, created_at, due_at, attempts, "
            f"problem) VALUES ({delivery})",
            "UPDATE sqlite_sequence SET seq = 12 WHERE name = 'alert_channels'",
        ):
            await session.execute(text(statement))

    async def found() -> tuple[object, ...]:
        async with sqlite.reading() as session:
            channels = (await session.execute(text("SELECT id, kind, target FROM alert_channels"))).all()
            deliveries = (await session.execute(text("SELECT id, channel_id, alert_id FROM alert_deliveries"))).all()
            last = await session.scalar(text("SELECT seq FROM sqlite_sequence WHERE name = 'alert_channels'"))
        return [*map(tuple, channels)], [*map(tuple, deliveries)], last

    kept = [(7, "mail", "a@example.org")], [(3, 7, 9)], 12
    await migrate(sqlite, "0029")
    assert await found() == kept
    async with sqlite.writing() as session:
        push = (
            "INSERT INTO alert_channels (user_id, kind, target, severity, drones, code_tries, created_at, problem)"
            f" VALUES (1, 'push', 'https://x/', 'warning', 'all', 0, {at}, '')"
        )
        await session.execute(text(push))
    await migrate(sqlite, "0028")
    assert (await found())[:2] == kept[:2]
    with pytest.raises(IntegrityError, match="ck_alert_channels_kind"):
        async with sqlite.writing() as session:
            await session.execute(text(push))


async def test_every_token_gets_an_end_and_no_number_is_used_twice(sqlite: Database) -> None:
    await migrate(sqlite, "0010")
    now = datetime.now(UTC)
    late = f"'{now + timedelta(days=3000):%Y-%m-%d} 00:00:00.000000'"
    ends = {1: "NULL", 2: late, 3: "'2026-01-01 00:00:00.000000'", 9: "NULL"}
    async with sqlite.writing() as session:
        user = "1, 'anna', 'anna', 'x', 'operator', '2026-01-01 00:00:00'"
        columns = "id, name, name_key, password_hash, role, created_at"
        await session.execute(text(f"INSERT INTO users ({columns}) VALUES ({user})"))
        for number, end in ends.items():
            row = f"{number}, 'h{number}', 1, 'program', 'watch', '2026-01-01 00:00:00', {end}"
            columns = "id, token_hash, user_id, name, scopes, created_at, expires_at"
            await session.execute(text(f"INSERT INTO api_tokens ({columns}) VALUES ({row})"))
        await session.execute(text("DELETE FROM api_tokens WHERE id = 9"))
    await migrate(sqlite)
    async with sqlite.writing() as session:
        found = {row.id: row.expires_at for row in await session.scalars(select(ApiTokenRow))}
        days = {number: round((end - now) / timedelta(days=1)) for number, end in found.items() if number < 3}
        assert days == {1: 90, 2: 365}
        assert found[3] == datetime(2026, 1, 1, tzinfo=UTC)
        row = ApiTokenRow(token_hash="x", user_id=1, name="new", scopes="watch", created_at=now, expires_at=now)
        session.add(row)
        await session.flush()
        assert row.id == 10


NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)


async def _settings_go_there_and_back(database: Database) -> None:
    """Upgrades to 0010 and back, with settings as older versions stored them."""
    await migrate(database, "0009")
    kept = {"lost_action": "nothing", "hold_bound_s": 60.0, "sticks_stale_s": 0.7}
    drones = {1: kept, 2: {"lost_action": "land"}}
    settings = table(
        "drone_settings", column("drone_id"), column("chosen", JSON), column("changed_at", DateTime(timezone=True))
    )
    async with database.writing() as session:
        for drone_id, chosen in drones.items():
            columns = "id, name, name_key, credential_hash, created_at"
            row = f"{drone_id}, 'd{drone_id}', 'd{drone_id}', 'x{drone_id}', '2026-01-01 00:00:00'"
            await session.execute(text(f"INSERT INTO drones ({columns}) VALUES ({row})"))
            await session.execute(insert(settings).values(drone_id=drone_id, chosen=chosen, changed_at=NOON))

    async def found() -> dict[int, object]:
        async with database.reading() as session:
            return {row.drone_id: row.chosen for row in await session.execute(select(settings))}

    await migrate(database)
    assert await found() == {1: {"lost_action": "stay", "sticks_stale_s": 0.7}, 2: {"lost_action": "land"}}
    await migrate(database, "0009")
    assert await found() == {1: {"lost_action": "nothing", "sticks_stale_s": 0.7}, 2: {"lost_action": "land"}}
    await migrate(database)
    await check_schema(database)


async def test_no_hold_has_a_bound_any_more_and_nothing_is_stay(sqlite: Database) -> None:
    await _settings_go_there_and_back(sqlite)


async def test_second_factors_in_the_clear_are_sealed_and_leave_no_trace(sqlite: Database, tmp_path: Path) -> None:
    key_file = tmp_path / "keys" / "secret.key"
    await _second_factors_are_sealed_and_opened(sqlite, Vault(key_file=key_file))
    assert key_file.stat().st_mode & 0o777 == 0o600
    await sqlite.close()
    files = (tmp_path / f"tower.sqlite3{ending}" for ending in ("", "-wal", "-shm"))
    left = b"".join(one.read_bytes() for one in files if one.exists())
    assert b"anna" in left
    assert not any(secret.encode() in left for secret in SECRETS.values())


async def test_observers_come_and_go_and_nothing_hangs_on_it(sqlite: Database) -> None:
    await migrate(sqlite, "0014")
    user = (
        "INSERT INTO users (name, name_key, password_hash, role, created_at) "
        "VALUES ('{0}', '{0}', 'x', '{1}', '2026-01-01 00:00:00')"
    )
    session_of = (
        "INSERT INTO sessions (token_hash, user_id, created_at, last_seen_at, address, user_agent) "
        "VALUES ('x', 1, '2026-01-01 00:00:00', '2026-01-01 00:00:00', '', '')"
    )
    async with sqlite.writing() as session:
        await session.execute(text(user.format("anna", "operator")))
        await session.execute(text(session_of))
    with pytest.raises(IntegrityError):
        async with sqlite.writing() as session:
            await session.execute(text(user.format("olga", "observer")))
    await migrate(sqlite)
    async with sqlite.writing() as session:
        await session.execute(text(user.format("olga", "observer")))
    with pytest.raises(IntegrityError):
        async with sqlite.writing() as session:
            await session.execute(text(user.format("eve", "emperor")))
    await migrate(sqlite, "0014")
    async with sqlite.reading() as session:
        rows = (await session.execute(text("SELECT name, role, disabled FROM users ORDER BY id"))).all()
        kept = (await session.execute(text("SELECT count(*) FROM sessions"))).scalar()
    assert [tuple(row) for row in rows] == [("anna", "operator", 0), ("olga", "operator", 1)]
    assert kept == 1
    with pytest.raises(IntegrityError):
        async with sqlite.writing() as session:
            await session.execute(text(user.format("otto", "observer")))
    await migrate(sqlite)
    await check_schema(sqlite)


async def test_alerts_survive_those_of_the_tower_and_their_removal(sqlite: Database) -> None:
    await migrate(sqlite, "0029")

    async def add(number: int, drone_id: str) -> None:
        row = f"({number}, 'gps', '', 'warning', 'No GPS', {drone_id}, 0, 'x', '2026-01-01 00:00:00.000000', '')"
        columns = "id, rule, subject, severity, badge, drone_id, about_stranger, words, opened_at, acknowledged_by_name"
        async with sqlite.writing() as session:
            await session.execute(text(f"INSERT INTO alerts ({columns}) VALUES {row}"))

    async def found() -> list[object]:
        async with sqlite.reading() as session:
            rows = await session.execute(text("SELECT id, drone_id FROM alerts ORDER BY id"))
        return [*map(tuple, rows.all())]

    await add(1, "5")
    with pytest.raises(IntegrityError, match="drone_id"):
        await add(2, "NULL")
    await migrate(sqlite, "0030")
    await add(2, "NULL")
    assert await found() == [(1, 5), (2, None)]
    await migrate(sqlite, "0029")
    assert await found() == [(1, 5)]
