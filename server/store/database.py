"""How the tower reaches its database: SQLite by default, PostgreSQL by DATABASE_URL. Holds no table and no rule.

Two doors, because the two databases agree on little else:
- `reading()`: one consistent picture, nothing may be written.
- `writing()`: one transaction, committed when the block ends well. On SQLite it takes the write lock at its
  beginning, so that "read, decide, write" never fails half way because another process wrote in between. The writers
  of this process go in one by one, in the order in which they came: SQLite lets those that wait try again at moments
  of chance, so that of many some would wait for longer than BUSY_TIMEOUT_MS, and fail.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

from sqlalchemy import DateTime, Dialect, MetaData, event, make_url
from sqlalchemy.exc import DBAPIError
from sqlalchemy.exc import TimeoutError as GaveUp
from sqlalchemy.ext.asyncio import AsyncEngine, AsyncSession, async_sessionmaker, create_async_engine
from sqlalchemy.orm import DeclarativeBase
from sqlalchemy.pool import QueuePool
from sqlalchemy.types import TypeDecorator

from server.runtime.private_files import make_private_file

BUSY_TIMEOUT_MS: Final = 5_000
"""How long a writer waits for another process (`tower drone add` beside a running tower) before it gives up."""

TURN_WITHIN_S: Final = 10.0
"""How long a writer waits for those of this process that came before: thousands, unless the database is stuck."""

NAMING: Final = {
    "ix": "ix_%(column_0_label)s",
    "uq": "uq_%(table_name)s_%(column_0_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


class Base(DeclarativeBase):
    """The base of every table. The naming makes constraints reachable by migrations on both databases."""

    metadata = MetaData(naming_convention=NAMING)


class UtcDateTime(TypeDecorator[datetime]):
    """A moment, always with a time zone in Python. SQLite has no such type and keeps it as UTC text."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError("a moment without a time zone must not be stored")
        value = value.astimezone(UTC)
        return value.replace(tzinfo=None) if dialect.name == "sqlite" else value

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


DatabaseSession = AsyncSession
"""One transaction. The floors above name it by this, and need no library for it."""
DatabaseError = DBAPIError
"""The database refused a statement, or went away."""


class PoolUse(NamedTuple):
    """Connections to the database. `size`: kept open at most."""

    in_use: int
    idle: int
    size: int


class Database:
    """An open database. Use `open_database`; `close` when done."""

    def __init__(self, engine: AsyncEngine) -> None:
        self.engine = engine
        sqlite = engine.dialect.name == "sqlite"
        reader = engine if sqlite else engine.execution_options(isolation_level="REPEATABLE READ")
        writer = engine.execution_options(tower_begin="BEGIN IMMEDIATE") if sqlite else engine
        self._reading = async_sessionmaker(reader, expire_on_commit=False, autoflush=False)
        self._writing = async_sessionmaker(writer, expire_on_commit=False)
        self._writers = asyncio.Lock() if sqlite else None

    @asynccontextmanager
    async def reading(self) -> AsyncIterator[AsyncSession]:
        async with self._reading() as session:
            yield session

    @asynccontextmanager
    async def writing(self) -> AsyncIterator[AsyncSession]:
        # The turn comes first: who waits for it has no connection yet, and keeps no reader from one.
        async with self._turn(), self._writing() as session, session.begin():
            yield session

    @asynccontextmanager
    async def _turn(self) -> AsyncIterator[None]:
        """Raises sqlalchemy.exc.TimeoutError."""
        if self._writers is None:
            yield
            return
        try:
            async with asyncio.timeout(TURN_WITHIN_S):
                await self._writers.acquire()
        except TimeoutError:
            raise GaveUp(f"the database has taken nothing for {TURN_WITHIN_S:g} s") from None
        try:
            yield
        finally:
            self._writers.release()

    def pool_use(self) -> PoolUse | None:
        """None where there is no pool of a bounded size."""
        pool = self.engine.pool
        return PoolUse(pool.checkedout(), pool.checkedin(), pool.size()) if isinstance(pool, QueuePool) else None

    async def close(self) -> None:
        await self.engine.dispose()


def open_database(url: str) -> Database:
    """Prepares the engine; the first connection is made by the first question. Its errors show no values: they end
    up in logs."""
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite":
        return Database(create_async_engine(parsed, pool_pre_ping=True, hide_parameters=True))
    engine = create_async_engine(parsed, hide_parameters=True)
    if parsed.database and not parsed.database.startswith("file:"):
        # Nobody else on the machine has any business with it.
        path = Path(parsed.database)
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        event.listen(engine.sync_engine, "do_connect", lambda *_: make_private_file(path))
    event.listen(engine.sync_engine, "connect", _prepare_sqlite)
    event.listen(engine.sync_engine, "begin", _begin_sqlite)
    return Database(engine)


def _prepare_sqlite(connection: Any, _record: Any) -> None:
    # The driver's own idea of when to begin a transaction leaves reads outside of any: take it over.
    connection.isolation_level = None
    cursor = connection.cursor()
    for pragma in (
        f"busy_timeout = {BUSY_TIMEOUT_MS}",
        "journal_mode = WAL",
        "synchronous = NORMAL",
        "foreign_keys = ON",
    ):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _begin_sqlite(connection: Any) -> None:
    connection.exec_driver_sql(connection.get_execution_options().get("tower_begin", "BEGIN"))
