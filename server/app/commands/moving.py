"""`tower backup`, `restore`, `check-backup`, `check-database`, `copy-database` and `migrate`: what concerns a database
as a whole.

docs/how-to/backup.md shows each at work.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar

import typer

from server.app.commands.first_start import create_database, in_words
from server.app.commands.session import CommandError, settings_now
from server.backup.store.archive import ArchiveReader, BadArchive
from server.backup.store.backup import make_backup
from server.backup.store.copying import CountsDiffer, copy_database
from server.backup.store.only_process import only_process
from server.backup.store.restore import CannotRestore, Place, restore
from server.kernel.clock import utc_now
from server.runtime.settings import Settings, SettingsError, read_settings
from server.storage.database import Database, open_database
from server.storage.integrity import fault_in, sqlite_file
from server.storage.schema import check_schema, current_revision, is_known_revision, migrate, newest_revision

LONG_S: Final = 3600.0
"""Timeout of these commands: tables of millions of rows."""
LOCK_SINCE: Final = "0016"
"""Older databases have no lock of a tower."""
Answer = TypeVar("Answer")
File = Annotated[Path, typer.Argument(help="The archive.", metavar="FILE", show_default=False)]


def add_to(app: typer.Typer) -> None:
    app.command("backup")(backup)
    app.command("restore")(restore_backup)
    app.command("check-backup")(check_backup)
    app.command("check-database")(check_database)
    app.command("copy-database")(copy_to)
    app.command("migrate")(migrate_database)


def backup(
    file: File,
    without_keys: Annotated[
        bool, typer.Option("--without-keys", help="Leave the keys out; keep them elsewhere, or nothing opens.")
    ] = False,
    without_files: Annotated[
        bool, typer.Option("--without-files", help="Leave flight logs and recordings out.")
    ] = False,
) -> None:
    """Write database, keys, flight logs and recordings into one archive, while the tower runs."""
    settings = settings_now()
    keys = "" if without_keys else _keys_of(settings)

    async def work() -> None:
        database = await _at_newest(settings.database_url)
        try:
            files = Path("/nonexistent") if without_files else settings.files
            made = await make_backup(database, file, files=files, keys=keys, clock=utc_now)
        finally:
            await database.close()
        typer.echo(
            f"{file}: {made.rows} rows of {made.tables} tables, {made.files} files, "
            f"{'the keys' if keys else 'no keys'}; {made.size_bytes} bytes"
        )
        _require_whole(settings)
        if made.skipped:
            typer.echo(f"{made.skipped} files were deleted meanwhile and are not in it", err=True)

    _run(work())


def check_database() -> None:
    """Read the database file completely and compare every index with its table. The tower may run."""
    settings = settings_now()
    if sqlite_file(settings.database_url) is None:
        raise CommandError("this is for SQLite: PostgreSQL has pg_amcheck")
    _require_whole(settings)
    typer.echo("the file of the database is whole")


def _require_whole(settings: Settings) -> None:
    """Raises CommandError."""
    file = sqlite_file(settings.database_url)
    fault = "" if file is None else fault_in(file, whole=True)
    if fault:
        raise CommandError(f"the file of the database, {file}, is damaged: {fault}. Restore the newest whole backup")


def restore_backup(file: File) -> None:
    """Put a backup into an empty place: no rows in the database, no files, no key. Then start the tower."""
    settings = settings_now()

    async def work() -> None:
        database = open_database(settings.database_url, timeout_s=LONG_S)
        place = Place(settings.files, None if settings.secret_keys else settings.secret_key_file)
        try:
            manifest, files = await restore(database, file, place, settings.vault())
        finally:
            await database.close()
        typer.echo(
            f"restored the backup of {manifest.made_at}: {sum(manifest.tables.values())} rows of "
            f"{len(manifest.tables)} tables, {files} files; the database is at revision {newest_revision()}"
        )
        typer.echo("everybody has to sign in again")

    _run(work())


def check_backup(file: File) -> None:
    """Read an archive completely and compare every checksum. Needs no database."""
    try:
        with ArchiveReader(file) as archive:
            manifest = archive.check()
    except BadArchive as error:
        raise CommandError(str(error)) from error
    typer.echo(
        f"{file} is complete: made {manifest.made_at} by version {manifest.version} at revision {manifest.revision}, "
        f"{sum(manifest.tables.values())} rows, {len(manifest.members)} members"
    )


def copy_to(
    url: Annotated[str, typer.Argument(help="sqlite:///FILE or postgresql://...", metavar="URL", show_default=False)],
) -> None:
    """Copy the database of DATABASE_URL to an empty one, of either kind, and compare the number of rows of each table.

    Stop the tower first. Files and keys stay where they are.
    """
    settings = settings_now()
    try:
        target_url = read_settings({"DATABASE_URL": url}).database_url
    except SettingsError as error:
        raise CommandError(f"URL {str(error).removeprefix('DATABASE_URL ')}") from error
    if target_url == settings.database_url:
        raise CommandError("URL is the database of DATABASE_URL itself")

    async def work() -> None:
        source = await _at_newest(settings.database_url)
        target = open_database(target_url, timeout_s=LONG_S)
        try:
            counts = await copy_database(
                source, target, settings.vault(), said=lambda table, rows: typer.echo(f"{table}: {rows} of {rows} rows")
            )
        finally:
            await target.close()
            await source.close()
        typer.echo(f"copied {sum(counts.values())} rows of {len(counts)} tables; set DATABASE_URL to the new address")

    _run(work())


def migrate_database(
    to: Annotated[
        str, typer.Option(metavar="REVISION", help="Go to this revision, up or down; `base` is the empty database.")
    ] = "head",
    first_admin: Annotated[
        bool, typer.Option("--first-admin", help="If there is no user yet, add an admin and print the password.")
    ] = False,
) -> None:
    """Create the database, or upgrade it to this version. `--to` also goes back, with the tower stopped."""
    settings = settings_now()
    if to not in ("head", "base") and not is_known_revision(to):
        raise CommandError(f"there is no revision {to}; the newest is {newest_revision()}")

    async def work() -> str | None:
        database = open_database(settings.database_url)
        try:
            if to == "head":
                await migrate(database, vault=settings.vault())
            elif (await current_revision(database) or "") >= LOCK_SINCE:
                async with only_process(database, one_transaction=True):
                    await migrate(database, to, vault=settings.vault())
            else:
                await migrate(database, to, vault=settings.vault())
            return await current_revision(database)
        finally:
            await database.close()

    typer.echo(f"the database is at revision {asyncio.run(work()) or 'base: it is empty'}")
    if first_admin and to == "head" and (password := create_database(settings)):
        typer.echo(in_words(password))


def _run(work: Coroutine[Any, Any, Answer]) -> Answer:
    try:
        return asyncio.run(work)
    except (BadArchive, CannotRestore, CountsDiffer) as error:
        raise CommandError(str(error)) from error


async def _at_newest(url: str) -> Database:
    """Opens the database. Raises DatabaseNotReady unless it has the newest revision."""
    database = open_database(url)  # with a short timeout: is it there at all?
    try:
        await check_schema(database)
    finally:
        await database.close()
    return open_database(url, timeout_s=LONG_S)


def _keys_of(settings: Settings) -> str:
    if settings.secret_keys:
        return "\n".join(settings.secret_key_list) + "\n"
    try:
        return settings.secret_key_file.read_text()
    except FileNotFoundError:
        return ""
