"""Puts a backup into an empty place: a database without rows, no files, no key. Nothing is ever overwritten.

The archive is read and checked completely before anything is written. The rows, of the version that wrote them, are
loaded in one transaction; then the database is upgraded. If anything fails before that, the place is empty again.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from server.backup.store.archive import DATABASE, KEYS, ArchiveReader, BadArchive, Manifest
from server.backup.store.only_process import only_process
from server.backup.store.row_lines import read_lines
from server.backup.store.table_rows import (
    copied_tables,
    count_rows,
    first_filled,
    remove_seeds,
    tables_there,
    write_counters,
)
from server.runtime.vault import Vault
from server.storage.database import Database, DatabaseSession
from server.storage.schema import is_known_revision, migrate

ENDED: Final = "sessions"
"""Nobody is signed in after a restore: a session that was ended since the backup must not come back."""


class CannotRestore(Exception):
    """The message says what is in the way, and what to do."""


@dataclass(frozen=True)
class Place:
    """Where a backup goes. `key_file`: None if the keys come from the environment."""

    files: Path
    key_file: Path | None


async def restore(database: Database, path: Path, place: Place, vault: Vault) -> tuple[Manifest, int]:
    """Returns what was restored, and the number of files. Raises CannotRestore, BadArchive, TowerLockHeld, OSError and
    what the database raises."""
    with ArchiveReader(path) as archive:
        manifest = archive.check()
        if not is_known_revision(manifest.revision):
            raise CannotRestore(
                f"the backup is of revision {manifest.revision}, which a newer version of the tower made: "
                f"restore it with version {manifest.version} or later"
            )
        await _check_empty(database, place)
        installed = _Installed(place)
        try:
            files = installed.install(archive)
            await migrate(database, manifest.revision, vault=vault)
            async with only_process(database, one_transaction=True):
                await _load(database, archive, manifest, installed.show_files)
        except BaseException:
            installed.remove()
            raise
    await migrate(database, vault=vault)
    return manifest, files


async def _check_empty(database: Database, place: Place) -> None:
    if place.files.exists() and any(place.files.iterdir()):
        raise CannotRestore(f"the folder {place.files} is not empty: move it away first")
    if place.key_file is not None and place.key_file.exists():
        raise CannotRestore(f"there is a key file {place.key_file} already: move it away first")
    async with database.reading() as session:
        filled = await first_filled(session)
    if filled is not None:
        raise CannotRestore(
            f"the database is not empty: the table {filled} has rows. Move it away, or name another in DATABASE_URL"
        )


async def _load(
    database: Database, archive: ArchiveReader, manifest: Manifest, before_commit: Callable[[], None]
) -> None:
    naive = database.engine.dialect.name == "sqlite"
    async with database.writing() as session:
        metadata = await tables_there(session)
        filled = await first_filled(session)
        if filled is not None:
            raise CannotRestore(f"the table {filled} was filled meanwhile")
        await remove_seeds(session, metadata)
        for table in copied_tables(metadata):
            if table.name not in manifest.tables:
                raise BadArchive(f"the backup lacks the table {table.name}")
            if table.name == ENDED:
                continue
            with archive.open(f"{DATABASE}{table.name}.jsonl.gz") as file:
                for rows in read_lines(file, table, naive=naive):
                    await session.execute(table.insert(), rows)
            await _compare(session, table.name, await count_rows(session, table), manifest)
        await write_counters(session, manifest.counters)
        before_commit()


async def _compare(session: DatabaseSession, table: str, count: int, manifest: Manifest) -> None:
    if count != manifest.tables[table]:
        raise BadArchive(f"the table {table} has {count} rows after loading, and should have {manifest.tables[table]}")


class _Installed:
    """The key and the files of a restore. They are removed again if it fails."""

    def __init__(self, place: Place) -> None:
        self._place = place
        self._staged = place.files.with_name(f"{place.files.name}.restoring")
        self._wrote_key = self._showed = False

    def install(self, archive: ArchiveReader) -> int:
        """Writes the key, and the files beside their folder. Returns their number."""
        shutil.rmtree(self._staged, ignore_errors=True)
        self._staged.mkdir(mode=0o700, parents=True)
        count = archive.extract_files(self._staged)
        keys = archive.read(KEYS)
        if keys is not None and self._place.key_file is not None:
            self._place.key_file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            descriptor = os.open(self._place.key_file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            self._wrote_key = True
            with os.fdopen(descriptor, "wb") as out:
                out.write(keys)
        return count

    def show_files(self) -> None:
        """Gives the folder of files its name."""
        with suppress(FileNotFoundError):
            self._place.files.rmdir()
        self._staged.rename(self._place.files)
        self._showed = True

    def remove(self) -> None:
        shutil.rmtree(self._place.files if self._showed else self._staged, ignore_errors=True)
        if self._wrote_key and self._place.key_file is not None:
            self._place.key_file.unlink(missing_ok=True)
