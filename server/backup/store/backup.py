"""Makes a backup while the tower runs: one snapshot of the database, the keys, and the files of drones.

The files are read after the snapshot. One that was deleted meanwhile is left out, and its row says that it is missing;
one that came meanwhile is unknown to the database, and treated like one found at the start of a tower.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Final

from sqlalchemy import text

from server.backup.store.archive import DATABASE, FILES, FORMAT, KEYS, ArchiveWriter, Manifest
from server.backup.store.row_lines import RowWriter
from server.backup.store.table_rows import copied_tables, read_counters, read_rows
from server.kernel.clock import Clock
from server.storage.database import Database, DatabaseSession

_UNFINISHED: Final = ".part"
"""Files that are being received or made."""


@dataclass(frozen=True)
class BackupFacts:
    """What an archive holds."""

    rows: int
    tables: int
    files: int
    size_bytes: int
    skipped: int = 0


async def make_backup(database: Database, path: Path, *, files: Path, keys: str, clock: Clock) -> BackupFacts:
    """`keys`: one a line; empty: they stay out of the archive. Raises BadArchive, OSError and what the database
    raises."""
    made_at = clock()
    with (
        ArchiveWriter(path) as archive,
        tempfile.TemporaryDirectory(dir=path.parent, prefix=".backup-") as scratch,
    ):
        async with database.reading() as session:
            revision = str(await session.scalar(text("SELECT version_num FROM alembic_version")))
            counts = await _add_tables(archive, session, Path(scratch))
            counters = await read_counters(session)
        if keys:
            archive.add_bytes(KEYS, keys.encode())
        added = [archive.add_file(f"{FILES}{name}", one) for name, one in _files_below(files)]
        manifest = Manifest(
            format=FORMAT,
            made_at=made_at.isoformat(),
            version=version("control-tower"),
            revision=revision,
            kind=database.engine.dialect.name,
            tables=counts,
            counters=counters,
            members=archive.members,
            skipped=added.count(False),
        )
        size_bytes = archive.finish(manifest)
    return BackupFacts(sum(counts.values()), len(counts), added.count(True), size_bytes, added.count(False))


async def _add_tables(archive: ArchiveWriter, session: DatabaseSession, scratch: Path) -> dict[str, int]:
    counts = {}
    for table in copied_tables():
        written = scratch / f"{table.name}.jsonl.gz"
        with RowWriter(written) as rows:
            async for batch in read_rows(session, table):
                rows.write(batch)
        archive.add_file(f"{DATABASE}{written.name}", written)
        written.unlink()
        counts[table.name] = rows.rows
    return counts


def _files_below(folder: Path) -> Iterator[tuple[str, Path]]:
    """Their names in the archive, and where they are. No links."""
    if not folder.is_dir():
        return
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.is_symlink() and not path.name.endswith(_UNFINISHED):
            yield path.relative_to(folder).as_posix(), path
