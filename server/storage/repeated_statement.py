"""One statement that the tower repeats for as long as it runs, at the price of one trip to the database.

It is compiled once, its connection is kept, and it is a transaction of its own. A session makes three or four trips for
the same, and prepares and reads a result that has one value: for the renewal of the lock and the check of the fleet
that was more than half of the load of an idle tower.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, Final

from sqlalchemy import Executable
from sqlalchemy.exc import DBAPIError
from sqlalchemy.ext.asyncio import AsyncEngine
from sqlalchemy.pool import PoolProxiedConnection
from sqlalchemy.sql import ClauseElement
from sqlalchemy.util import greenlet_spawn

ENDS_WITHIN_S: Final = 1.0


class RepeatedStatement:
    """Calls may overlap: one that still waits keeps its connection, and the next opens another. Its connection does not
    count for the pool. It knows neither the guard of a database nor its queue of writers."""

    def __init__(self, engine: AsyncEngine, statement: Executable) -> None:
        assert isinstance(statement, ClauseElement)
        self._engine = engine
        self._dialect: Final = engine.dialect
        compiled: Any = statement.compile(dialect=self._dialect)
        self._sql = str(compiled)
        self._names: tuple[str, ...] = tuple(compiled.positiontup or ())
        self._fixed: dict[str, Any] = compiled.params
        types = {name: compiled.binds[name].type.dialect_impl(self._dialect) for name in self._names}
        self._encoders = {name: kind.bind_processor(self._dialect) for name, kind in types.items()}
        self._kept: PoolProxiedConnection | None = None
        self._ending: set[asyncio.Task[None]] = set()

    async def scalar(self, **values: Any) -> Any:
        """Returns the first column of the first row; None without a row. Raises DBAPIError, OSError, and SQLAlchemy's
        TimeoutError."""
        connection, self._kept = self._kept, None
        if connection is not None:
            try:
                return await self._execute(connection, values)
            except DBAPIError as error:
                if not error.connection_invalidated:
                    raise
            # The connection ended since the last call. That says nothing about the database: it may have restarted.
        return await self._execute(await self._connect(), values)

    async def close(self) -> None:
        """The next call opens a connection again."""
        if self._kept is not None:
            self._drop(self._kept)
            self._kept = None
        if self._ending:
            await asyncio.wait(self._ending, timeout=ENDS_WITHIN_S)

    async def _execute(self, connection: PoolProxiedConnection, values: dict[str, Any]) -> Any:
        parameters = tuple(self._encoded(name, values) for name in self._names)
        is_whole = False
        try:
            found = await greenlet_spawn(self._first_value, connection, parameters)
            is_whole = True
        except self._driver_error as error:
            is_whole = not self._dialect.is_disconnect(error, connection.dbapi_connection, None)  # type: ignore[arg-type]
            raise self._translated(error, ended=not is_whole) from error
        finally:
            if is_whole and self._kept is None:
                self._kept = connection
            else:  # it ended, or its answer may still come
                self._drop(connection)
        return found

    def _first_value(self, connection: PoolProxiedConnection, parameters: tuple[Any, ...]) -> Any:
        cursor = connection.cursor()
        try:
            cursor.execute(self._sql, parameters)
            row = cursor.fetchone()
        finally:
            cursor.close()
        return row[0] if row else None

    async def _connect(self) -> PoolProxiedConnection:
        opening = asyncio.create_task(self._open())
        try:
            return await asyncio.shield(opening)
        except asyncio.CancelledError:
            self._end(self._drop_opened(opening))  # half open it would stay until it is found as garbage
            raise

    async def _open(self) -> PoolProxiedConnection:
        try:
            connection = await self._engine.raw_connection()
            connection.detach()
            await greenlet_spawn(self._dialect.set_isolation_level, connection.dbapi_connection, "AUTOCOMMIT")
        except self._driver_error as error:
            raise self._translated(error, ended=True) from error
        return connection

    async def _drop_opened(self, opening: asyncio.Task[PoolProxiedConnection]) -> None:
        connection = await opening
        await greenlet_spawn(self._dialect.do_terminate, connection.dbapi_connection)

    def _encoded(self, name: str, values: dict[str, Any]) -> Any:
        value = values[name] if name in values else self._fixed[name]
        encode = self._encoders[name]
        return value if encode is None else encode(value)

    @property
    def _driver_error(self) -> type[Exception]:
        driver = self._dialect.loaded_dbapi
        assert driver is not None
        return driver.Error

    def _translated(self, error: Exception, *, ended: bool) -> DBAPIError:
        translated = DBAPIError.instance(
            self._sql, None, error, self._driver_error, hide_parameters=True, connection_invalidated=ended
        )
        assert isinstance(translated, DBAPIError)
        return translated

    def _drop(self, connection: PoolProxiedConnection) -> None:
        """Ends the connection in the background: a hanging database delays nobody."""
        self._end(greenlet_spawn(self._dialect.do_terminate, connection.dbapi_connection))

    def _end(self, ends: Coroutine[Any, Any, None]) -> None:
        ending = asyncio.create_task(ends)
        self._ending.add(ending)
        ending.add_done_callback(self._ended)

    def _ended(self, ending: asyncio.Task[None]) -> None:
        self._ending.discard(ending)
        if not ending.cancelled():
            ending.exception()  # nobody else retrieves it
