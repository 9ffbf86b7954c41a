"""SQLite's connections for SQLAlchemy: each statement is one trip to the connection's thread.

aiosqlite makes four: it opens a cursor, executes, fetches and closes. Each trip wakes the event loop, and a change of
controls has a dozen statements.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from typing import Any, Final

import aiosqlite

ROWS_AT_ONCE: Final = 500
"""Fetched with the statement. More rows cost more trips, and a query that streams keeps no more in memory."""


class _Cursor:
    """What SQLAlchemy uses of an aiosqlite.Cursor."""

    arraysize = 1

    def __init__(self, connection: OneTripConnection) -> None:
        self._connection = connection
        self._cursor: sqlite3.Cursor | None = None
        self._rows: list[Any] = []
        self._is_complete = True
        """SQLite has no more rows than those in `_rows`."""

    async def __aenter__(self) -> _Cursor:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def execute(self, statement: str, parameters: Any = ()) -> _Cursor:
        await self._connection.run(self._execute, statement, parameters)
        return self

    async def executemany(self, statement: str, parameters: Any) -> _Cursor:
        await self._connection.run(self._execute_many, statement, parameters)
        return self

    async def fetchall(self) -> Sequence[Any]:
        if not self._is_complete:
            await self._connection.run(self._fetch, None)
        rows, self._rows = self._rows, []
        return rows

    async def fetchmany(self, size: int | None = None) -> Sequence[Any]:
        size = self.arraysize if size is None else size
        if len(self._rows) < size and not self._is_complete:
            await self._connection.run(self._fetch, max(size - len(self._rows), ROWS_AT_ONCE))
        rows, self._rows = self._rows[:size], self._rows[size:]
        return rows

    async def fetchone(self) -> Any | None:
        rows = await self.fetchmany(1)
        return rows[0] if rows else None

    async def close(self) -> None:
        cursor, self._cursor, self._rows = self._cursor, None, []
        if cursor is not None and not self._is_complete:
            await self._connection.run(cursor.close)

    @property
    def description(self) -> Any:
        return None if self._cursor is None else self._cursor.description

    @property
    def rowcount(self) -> int:
        return -1 if self._cursor is None else self._cursor.rowcount

    @property
    def lastrowid(self) -> int | None:
        return None if self._cursor is None else self._cursor.lastrowid

    # -- in the connection's thread

    def _execute(self, statement: str, parameters: Any) -> None:
        self._cursor = self._connection.sqlite.execute(statement, parameters)
        self._rows, self._is_complete = [], self._cursor.description is None
        if not self._is_complete:
            self._fetch(ROWS_AT_ONCE)

    def _execute_many(self, statement: str, parameters: Any) -> None:
        self._cursor = self._connection.sqlite.executemany(statement, parameters)
        self._rows, self._is_complete = [], True

    def _fetch(self, at_most: int | None) -> None:
        assert self._cursor is not None
        rows = self._cursor.fetchall() if at_most is None else self._cursor.fetchmany(at_most)
        self._rows += rows
        self._is_complete = at_most is None or len(rows) < at_most


class OneTripConnection(aiosqlite.Connection):
    """A connection whose cursors are opened, read and closed on the way."""

    def cursor(self) -> _Cursor:  # type: ignore[override]
        return _Cursor(self)

    @property
    def sqlite(self) -> sqlite3.Connection:
        """Raises ValueError if the connection is closed."""
        return self._conn

    async def run(self, function: Any, *arguments: Any) -> Any:
        """Calls it in the connection's thread."""
        return await self._execute(function, *arguments)  # type: ignore[no-untyped-call]


def connect(database: str, **options: Any) -> OneTripConnection:
    """See sqlite3.connect. Await the result."""
    connection = OneTripConnection(lambda: sqlite3.connect(database, **options), iter_chunk_size=ROWS_AT_ONCE)
    connection._thread.daemon = True  # as SQLAlchemy does: the process need not wait for it
    return connection


def use_one_trip(_dialect: object, _record: object, _arguments: object, options: dict[str, Any]) -> None:
    """SQLAlchemy's event `do_connect`."""
    options["async_creator_fn"] = connect
