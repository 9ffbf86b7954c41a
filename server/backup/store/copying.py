"""Copies a whole database to another, empty one, of either kind, and compares the number of rows of every table."""

from __future__ import annotations

from collections.abc import Callable

from server.backup.store.only_process import only_process
from server.backup.store.restore import CannotRestore
from server.backup.store.table_rows import (
    copied_tables,
    count_rows,
    first_filled,
    read_counters,
    read_rows,
    remove_seeds,
    write_counters,
)
from server.runtime.vault import Vault
from server.storage.database import Database
from server.storage.schema import migrate
from server.storage.tables import METADATA


class CountsDiffer(Exception):
    """Nothing was copied: the message names the table."""


async def copy_database(
    source: Database, target: Database, vault: Vault, *, said: Callable[[str, int], None] = lambda table, rows: None
) -> dict[str, int]:
    """Returns the rows of each table. `said`: called after each table. No tower may run on either of them. Raises
    CannotRestore, CountsDiffer, TowerLockHeld and what the databases raise."""
    async with only_process(source):
        await _check_empty(target)  # before anything is changed there
        await migrate(target, vault=vault)
        async with only_process(target, one_transaction=True), source.reading() as reading, target.writing() as writing:
            await remove_seeds(writing, METADATA)
            counts = {}
            for table in copied_tables():
                async for rows in read_rows(reading, table):
                    await writing.execute(table.insert(), rows)
                here, there = await count_rows(reading, table), await count_rows(writing, table)
                if here != there:
                    raise CountsDiffer(f"the table {table.name} has {here} rows, and its copy {there}")
                counts[table.name] = there
                said(table.name, there)
            await write_counters(writing, await read_counters(reading))
    return counts


async def _check_empty(target: Database) -> None:
    async with target.reading() as session:
        filled = await first_filled(session)
    if filled is not None:
        raise CannotRestore(f"the database to copy to is not empty: the table {filled} has rows")
