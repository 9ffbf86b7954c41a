"""Access to the database: SQLite by default, PostgreSQL by DATABASE_URL. Contains no table and no rule.

There are two entry points, because the two databases have little else in common:
- `reading()`: one consistent snapshot, without writes.
- `writing()`: one transaction, committed when the block succeeds. On SQLite it takes the write lock at its beginning,
  so that "read, decide, write" never fails half way because of another process. Writers of this process have turns
  (`writer_turns.py`): SQLite retries waiting writers at random times, so that with many some would wait longer than the
  timeout, and fail.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import AbstractContextManager, AsyncExitStack, asynccontextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar, cast

from sqlalchemy import URL, DateTime, Dialect, Executable, MetaData, event, make_url
from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, ProgrammingError, SQLAlchemyError
from sqlalchemy.exc import TimeoutError as GaveUp
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine, AsyncSession, async_sessionmaker, create_async_engine
from sqlalchemy.orm import DeclarativeBase
from sqlalchemy.pool import QueuePool
from sqlalchemy.types import TypeDecorator

from server.runtime.private_files import make_private_file
from server.storage.database_wait import (
    DatabaseWait,
    EndingTasks,
    current_wait,
    giving_up_after,
    left_s,
    waiting_at_most,
)
from server.storage.repeated_statement import RepeatedStatement
from server.storage.sqlite_driver import use_one_trip
from server.storage.writer_turns import WriterTurns, writing_person

TIMEOUT_S: Final = 2.0
"""Maximum time for the database to respond, to be reached, or to be free for a writer."""

_SQLITE_POOL: Final[dict[str, Any]] = {"pool_size": 15, "max_overflow": 0, "pool_use_lifo": True}
"""As many connections as SQLAlchemy allows by default, but none is closed after use: each has a thread, and starting
one blocks the event loop."""

WARM_CONNECTIONS: Final = 6
"""Opened before the tower listens: a flood of requests would open them all at once, and block every frame for 70 ms."""

COMMAND_TIMEOUT_S: Final = 5.0
"""The same for a command (`tower drone add` beside a running tower), which no flight depends on."""

TRANSACTION_TIMEOUTS: Final = 3
"""A transaction is given up after this many timeouts, even if each statement is answered in time."""

NOT_TRIED_FOR_S: Final = 10.0

BUSY_STEP_MS: Final = 50
"""SQLite may wait this much longer than its caller, because setting the exact time would cost a statement each time."""
_BUSY_MS: Final = "tower_busy_ms"

NAMING: Final = {
    "ix": "ix_%(column_0_label)s",
    "uq": "uq_%(table_name)s_%(column_0_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


class Base(DeclarativeBase):
    """The base of every table. The naming convention lets migrations address constraints on both databases."""

    metadata = MetaData(naming_convention=NAMING)


class UtcDateTime(TypeDecorator[datetime]):
    """A time, always with a time zone in Python. SQLite has no such type and stores it as UTC text."""

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


Found = TypeVar("Found")
DatabaseSession = AsyncSession
"""One transaction. Lets other modules name the type without importing the library."""
DatabaseError = DBAPIError
"""The database refused a statement, or disconnected."""


class DatabaseUnavailable(SQLAlchemyError):
    """The database cannot be reached, does not respond in time, or accepts no writes. Nothing was carried out, unless
    the response to a commit was lost."""


class LockLost(DatabaseUnavailable):
    """Another process is the tower of this database: this one no longer writes."""


class AnswerTimes:
    """Counters of the database's responses."""

    def __init__(self) -> None:
        self.transactions = 0
        self.failures = 0
        self.total_s = 0.0
        self.last_s = 0.0
        self.failing = False
        """Whether the last completed transaction found the database unreachable."""
        self._write_failed_at = float("-inf")

    def takes_writes(self) -> bool:
        """As far as is known: writes of low value are not tried shortly after a failed one."""
        return time.perf_counter() - self._write_failed_at > NOT_TRIED_FOR_S

    def ended(self, took_s: float, *, failed: bool, wrote: bool) -> None:
        if wrote:
            self._write_failed_at = time.perf_counter() if failed else float("-inf")
        self.transactions += 1
        self.failures += failed
        self.failing = failed
        self.total_s += took_s
        self.last_s = took_s


class PoolUse(NamedTuple):
    """Connections to the database. `size`: the maximum kept open."""

    in_use: int
    idle: int
    size: int


class Database:
    """An open database. Create it with `open_database`; `close` it when done."""

    def __init__(self, engine: AsyncEngine, *, timeout_s: float = COMMAND_TIMEOUT_S) -> None:
        self.engine = engine
        self.answers = AnswerTimes()
        self.guard: Callable[[AsyncSession], Awaitable[None]] | None = None
        """Called at the beginning of each writing transaction; raises if this process may not write."""
        self.on_write: Callable[[int], None] = lambda person: None
        """Called with whose transaction it is, before each writing one; 0: the tower's own."""
        self._timeout_s = timeout_s
        self._ending = EndingTasks()
        self._repeated: list[RepeatedStatement] = []
        sqlite = engine.dialect.name == "sqlite"
        reader = engine if sqlite else engine.execution_options(isolation_level="REPEATABLE READ")
        writer = engine.execution_options(tower_begin="BEGIN IMMEDIATE") if sqlite else engine
        self._reading = async_sessionmaker(reader, expire_on_commit=False, autoflush=False)
        self._writing = async_sessionmaker(writer, expire_on_commit=False)
        self._writers = WriterTurns() if sqlite else None

    @asynccontextmanager
    async def reading(self) -> AsyncIterator[AsyncSession]:
        """Raises DatabaseUnavailable."""
        async with self._in_time(wrote=False), self._reading() as session:
            yield session

    @asynccontextmanager
    async def querying(self) -> AsyncIterator[AsyncConnection]:
        """For queries of columns that every request makes: half the cost of `reading`. Raises DatabaseUnavailable."""
        async with self._in_time(wrote=False), self.engine.connect() as connection:
            yield connection

    @asynccontextmanager
    async def writing(self, *, first: bool = False) -> AsyncIterator[AsyncSession]:
        """`first`: a change of who flies a drone, which waits for nothing else. Raises DatabaseUnavailable, and
        LockLost from the guard."""
        self.on_write(writing_person())
        # The turn comes first: a waiting writer has no connection yet, and keeps no reader from one.
        async with self._in_time(wrote=True), self._turn(first=first), self._writing() as session, session.begin():
            if self.guard is not None:
                await self.guard(session)
            yield session

    @asynccontextmanager
    async def _in_time(self, *, wrote: bool) -> AsyncIterator[None]:
        began, failed, wait = time.perf_counter(), True, current_wait()
        at_most_s = self._timeout_s * TRANSACTION_TIMEOUTS if wait is None else wait.left_s
        try:
            if not at_most_s:
                raise DatabaseUnavailable("the database did not answer this request before, and was not asked again")
            with giving_up_after(at_most_s):
                async with asyncio.timeout(at_most_s):
                    yield
            failed = False
        except DatabaseUnavailable:
            raise
        except (DBAPIError, GaveUp) as error:
            if isinstance(error, (IntegrityError, ProgrammingError, DataError)):
                failed = False
                raise  # the database responded
            raise DatabaseUnavailable(_words(error)) from error
        except (TimeoutError, ConnectionError) as error:
            raise DatabaseUnavailable(f"the database did not answer: {type(error).__name__}") from error
        except BaseException:
            failed = False
            raise
        finally:
            took_s = time.perf_counter() - began
            self.answers.ended(took_s, failed=failed, wrote=wrote)
            if failed and wait is not None:
                wait.failed_after(took_s)

    @asynccontextmanager
    async def _turn(self, *, first: bool) -> AsyncIterator[None]:
        """Raises DatabaseUnavailable."""
        async with AsyncExitStack() as stack:
            if self._writers is not None:
                try:
                    await stack.enter_async_context(self._writers.turn(left_s(self._timeout_s), first=first))
                except TimeoutError:
                    raise DatabaseUnavailable(f"the database has taken nothing for {self._timeout_s:g} s") from None
            yield

    def repeated(self, statement: Executable) -> RepeatedStatement:
        """Prepares a statement that runs again and again. Its connection closes with the database."""
        prepared = RepeatedStatement(self.engine, statement)
        self._repeated.append(prepared)
        return prepared

    async def ask(self, question: RepeatedStatement) -> Any:
        """Reads one value, as a transaction that is timed and counted. Raises DatabaseUnavailable."""
        async with self._in_time(wrote=False):
            return await question.scalar()

    async def in_time(self, work: Coroutine[Any, Any, Found]) -> Found:
        """For queries with a fallback: does not wait for the end of a transaction that was given up either. Raises
        DatabaseUnavailable, and what `work` raises."""
        with self.bounded_wait() as wait:
            working: asyncio.Future[Any] = asyncio.create_task(work)
            try:
                await asyncio.wait({working, wait.overdue}, return_when=asyncio.FIRST_COMPLETED)
                if working.done():
                    return cast("Found", working.result())
            finally:
                if not working.done():
                    wait.failed_after(wait.left_s)
                    self._ending.let_end(working)
        raise DatabaseUnavailable("the database did not answer in time")

    def bounded_wait(self) -> AbstractContextManager[DatabaseWait]:
        """For a request: limits the total time of failing transactions in this block to that of one."""
        return waiting_at_most(self._timeout_s)

    async def warm_up(self) -> None:
        """Opens WARM_CONNECTIONS, if there is a pool that keeps them."""
        if isinstance(self.engine.pool, QueuePool):
            async with AsyncExitStack() as opened:
                for _ in range(WARM_CONNECTIONS):
                    await opened.enter_async_context(self.engine.connect())

    def pool_use(self) -> PoolUse | None:
        """None without a pool of bounded size."""
        pool = self.engine.pool
        return PoolUse(pool.checkedout(), pool.checkedin(), pool.size()) if isinstance(pool, QueuePool) else None

    async def close(self) -> None:
        for statement in self._repeated:
            await statement.close()
        await self.engine.dispose()


def _words(error: SQLAlchemyError) -> str:
    """The database's own message, if any: one line, without values."""
    said = str(getattr(error, "orig", None) or error).splitlines()
    return f"the database did not answer: {said[0] if said else type(error).__name__}"


def open_database(url: str, *, timeout_s: float = COMMAND_TIMEOUT_S) -> Database:
    """Prepares the engine; the first query connects. Its errors show no values, because they are logged. `timeout_s`:
    of each query, each wait for another writer, and each attempt to connect."""
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite":
        return Database(_postgres(parsed, timeout_s), timeout_s=timeout_s)
    is_file = bool(parsed.database) and not str(parsed.database).startswith("file:")
    pool = {**_SQLITE_POOL, "pool_timeout": timeout_s} if is_file else {}
    engine = create_async_engine(parsed, hide_parameters=True, **pool)
    if parsed.database and is_file:
        # Only the tower's own user may read it.
        path = Path(parsed.database)
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        event.listen(engine.sync_engine, "do_connect", lambda *_: make_private_file(path))
    event.listen(engine.sync_engine, "do_connect", use_one_trip)
    event.listen(engine.sync_engine, "connect", partial(_prepare_sqlite, round(timeout_s * 1000)))
    event.listen(engine.sync_engine, "begin", partial(_begin_sqlite, timeout_s))
    return Database(engine, timeout_s=timeout_s)


def sqlite_file(url: str) -> Path | None:
    """Returns the file of an SQLite database; None for one in memory, and for PostgreSQL."""
    parsed = make_url(url)
    return Path(parsed.database) if parsed.get_backend_name() == "sqlite" and parsed.database else None


def _postgres(url: URL, timeout_s: float) -> AsyncEngine:
    # The server ends transactions that this process does not: a stopped tower must not execute one when it resumes, nor
    # keep its locks until then.
    timeout_ms = str(round(timeout_s * 1000))
    return create_async_engine(
        url,
        pool_pre_ping=True,
        hide_parameters=True,
        pool_timeout=timeout_s,
        connect_args={
            "timeout": timeout_s,
            "command_timeout": timeout_s,
            "server_settings": {
                "statement_timeout": timeout_ms,
                "idle_in_transaction_session_timeout": timeout_ms,
            },
        },
    )


def _prepare_sqlite(timeout_ms: int, connection: Any, _record: Any) -> None:
    # The driver leaves reads outside of any transaction: the tower begins transactions itself.
    connection.isolation_level = None
    cursor = connection.cursor()
    for pragma in (
        f"busy_timeout = {timeout_ms}",
        "journal_mode = WAL",
        "synchronous = NORMAL",
        "foreign_keys = ON",
    ):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _begin_sqlite(timeout_s: float, connection: Any) -> None:
    # SQLite waits in a thread that cannot be cancelled: it must not wait longer than its caller.
    wait_ms = max(1, round(left_s(timeout_s) * 1000))
    set_ms = connection.info.get(_BUSY_MS, round(timeout_s * 1000))
    if not set_ms - BUSY_STEP_MS <= wait_ms <= set_ms:
        connection.exec_driver_sql(f"PRAGMA busy_timeout = {wait_ms}")
        connection.info[_BUSY_MS] = wait_ms
    connection.exec_driver_sql(connection.get_execution_options().get("tower_begin", "BEGIN"))
