"""Whether the database has the schema of this version, and how to migrate it. The steps are in `migrations/`.

Alembic is loaded only to migrate: it would be a tenth of the processor time of a start.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sqlalchemy import Column, Connection, MetaData, String, Table, inspect, select
from sqlalchemy.exc import DBAPIError

from server.runtime.packaged import MIGRATIONS
from server.runtime.vault import Vault
from server.storage.database import Database

if TYPE_CHECKING:
    from alembic.config import Config

_VERSION: Final = Table("alembic_version", MetaData(), Column("version_num", String(32)))


class DatabaseNotReady(Exception):
    """The message says what is wrong and which command corrects it."""


async def check_schema(database: Database) -> None:
    """Raises DatabaseNotReady unless the database is at the newest revision."""
    try:
        async with database.engine.connect() as connection:
            found = await connection.run_sync(_current_revision)
    except (DBAPIError, OSError) as error:
        reason = error.orig if isinstance(error, DBAPIError) else error
        raise DatabaseNotReady(f"the database cannot be reached: {reason}") from error
    wanted = newest_revision()
    if found == wanted:
        return
    if found is None:
        raise DatabaseNotReady("the database is empty: run `tower migrate` first")
    if found not in _known_revisions():
        raise DatabaseNotReady(
            f"the database is at revision {found}, which a newer version of the tower made: "
            "run that version, or restore an older backup"
        )
    raise DatabaseNotReady(f"the database is at revision {found} and has to be at {wanted}: run `tower migrate`")


def newest_revision() -> str | None:
    """Returns the newest one; None without any. Files are named after their revisions, which are numbers in order."""
    return max(_known_revisions(), default=None)


async def migrate(database: Database, revision: str = "head", *, vault: Vault | None = None) -> None:
    """Upgrades the database (or, with an older `revision`, downgrades it) to `revision`; "base" is the empty database.

    `vault`: seals what older versions stored in the clear; None: that of the settings in the environment.
    """
    async with database.engine.begin() as connection:
        await connection.run_sync(_migrate, revision, vault)


async def current_revision(database: Database) -> str | None:
    """None: the database is empty."""
    async with database.engine.connect() as connection:
        return await connection.run_sync(_current_revision)


def is_known_revision(revision: str) -> bool:
    """Whether this version has the steps to it."""
    return revision in _known_revisions()


def _migrate(connection: Connection, revision: str, vault: Vault | None) -> None:
    from alembic import command
    from alembic.script import ScriptDirectory

    config = _config()
    config.attributes["connection"] = connection
    config.attributes["vault"] = vault
    known = [one.revision for one in ScriptDirectory.from_config(config).walk_revisions()]  # newest first
    current = _current_revision(connection)
    wanted = known[0] if revision == "head" else revision
    goes_down = current in known and (wanted == "base" or known.index(wanted) > known.index(current))
    (command.downgrade if goes_down else command.upgrade)(config, revision)


def _config() -> Config:
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    return config


def _current_revision(connection: Connection) -> str | None:
    if not inspect(connection).has_table(_VERSION.name):
        return None
    return connection.execute(select(_VERSION.c.version_num)).scalar_one_or_none()


def _known_revisions() -> set[str]:
    return {step.name.partition("_")[0] for step in (MIGRATIONS / "versions").glob("[0-9]*_*.py")}
