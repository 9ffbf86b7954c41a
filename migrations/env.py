"""Runs the migrations on the database in the settings (SQLite or PostgreSQL), asynchronously."""

import asyncio
import os

from alembic import context
from sqlalchemy import Connection

from server.runtime.settings import read_settings
from server.storage.database import open_database
from server.storage.tables import METADATA


def _run(connection: Connection) -> None:
    # SQLite cannot alter most things in place: batch mode copies the table instead.
    context.configure(connection=connection, target_metadata=METADATA, render_as_batch=True)
    with context.begin_transaction():
        context.run_migrations()


async def _connect_and_run(url: str) -> None:
    database = open_database(url)
    try:
        async with database.engine.begin() as connection:
            await connection.run_sync(_run)
    finally:
        await database.close()


def _url() -> str:
    return context.config.attributes.get("url") or read_settings(os.environ).database_url


if context.is_offline_mode():
    context.configure(url=_url(), target_metadata=METADATA, literal_binds=True, render_as_batch=True)
    with context.begin_transaction():
        context.run_migrations()
elif (given := context.config.attributes.get("connection")) is not None:
    _run(given)
else:
    asyncio.run(_connect_and_run(_url()))
