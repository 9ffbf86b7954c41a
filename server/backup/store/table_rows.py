"""The rows of every table: read in one snapshot, written in one transaction, the same for SQLite and PostgreSQL.

Not copied: the lock of the running tower. Numbers that were used once stay used: the counters behind the ids go along.
"""

from __future__ import annotations

import warnings
from collections.abc import AsyncIterator, Mapping, Sequence
from typing import Any, Final

from sqlalchemy import Connection, MetaData, Table, func, inspect, select, text
from sqlalchemy.exc import SAWarning

from server.storage.database import DatabaseSession
from server.storage.tables import METADATA
from server.towers.store.tower_lock_tables import TowerLockRow

ROWS_AT_ONCE: Final = 1000
NOT_COPIED: Final = frozenset({TowerLockRow.__tablename__})
SEEDED: Final = frozenset({"fleet_revision", "audit_chain_state"})
"""Tables of one row that a migration makes."""

Row = dict[str, Any]


def copied_tables(metadata: MetaData = METADATA) -> list[Table]:
    """In an order in which each row finds what it refers to."""
    return [table for table in metadata.sorted_tables if table.name not in NOT_COPIED]


async def tables_there(session: DatabaseSession) -> MetaData:
    """The tables as the database has them, which may be those of an older version."""

    def reflect(connection: Connection) -> MetaData:
        found = MetaData()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SAWarning)  # of indexes that it cannot describe
            found.reflect(connection, only=lambda name, _: name != "alembic_version")
        return found

    return await (await session.connection()).run_sync(reflect)


async def read_rows(session: DatabaseSession, table: Table) -> AsyncIterator[Sequence[Row]]:
    """In the order of the primary key, some at a time."""
    query = select(table).order_by(*table.primary_key.columns).execution_options(yield_per=ROWS_AT_ONCE)
    found = await session.stream(query)
    async for some in found.mappings().partitions():
        yield [dict(row) for row in some]


async def count_rows(session: DatabaseSession, table: Table) -> int:
    return int(await session.scalar(select(func.count()).select_from(table)) or 0)


async def first_filled(session: DatabaseSession) -> str | None:
    """Returns the name of a table with rows that no migration made."""
    for table in copied_tables(await tables_there(session)):
        row = select(text("1")).select_from(table).limit(1)
        if table.name not in SEEDED and await session.scalar(row) is not None:
            return table.name
    return None


async def remove_seeds(session: DatabaseSession, metadata: MetaData) -> None:
    for table in metadata.sorted_tables:
        if table.name in SEEDED:
            await session.execute(table.delete())


async def read_counters(session: DatabaseSession) -> dict[str, int]:
    """The highest id that each table has ever given out, by table."""
    if _is_sqlite(session):
        there = await session.scalar(text("SELECT 1 FROM sqlite_master WHERE name = 'sqlite_sequence'"))
        rows = (await session.execute(text("SELECT name, seq FROM sqlite_sequence"))).all() if there else ()
        names = {table.name for table in copied_tables()}
        return {name: int(last) for name, last in rows if name in names}
    found = {}
    for table, sequence in (await _sequences(session)).items():
        last, used = (await session.execute(text(f"SELECT last_value, is_called FROM {sequence}"))).one()  # noqa: S608
        if used:
            found[table] = int(last)
    return found


async def write_counters(session: DatabaseSession, counters: Mapping[str, int]) -> None:
    """Raises each counter to this, and to the highest id that is there."""
    if _is_sqlite(session):
        for name, last in counters.items():
            known = {"name": name, "last": last}
            changed = await session.execute(
                text("UPDATE sqlite_sequence SET seq = max(seq, :last) WHERE name = :name"), known
            )
            if not changed.rowcount:  # type: ignore[attr-defined]
                await session.execute(text("INSERT INTO sqlite_sequence (name, seq) VALUES (:name, :last)"), known)
        return
    for table, sequence in (await _sequences(session)).items():
        highest = await session.scalar(text(f"SELECT max(id) FROM {table}"))  # noqa: S608
        last = max(int(highest or 0), counters.get(table, 0))
        if last:
            await session.execute(text("SELECT setval(:sequence, :last)"), {"sequence": sequence, "last": last})


def _is_sqlite(session: DatabaseSession) -> bool:
    return session.get_bind().dialect.name == "sqlite"


async def _sequences(session: DatabaseSession) -> dict[str, str]:
    """The sequence behind the id of each table that has one, on PostgreSQL."""

    def names(connection: Connection) -> list[str]:
        return sorted(set(inspect(connection).get_table_names()) & set(METADATA.tables))

    found = {}
    for table in await (await session.connection()).run_sync(names):
        if "id" in METADATA.tables[table].columns:
            sequence = await session.scalar(text(f"SELECT pg_get_serial_sequence('{table}', 'id')"))
            if sequence is not None:
                found[table] = str(sequence)
    return found
