"""One compilation of each SQL statement for all SQLite databases that a process of tests opens.

SQLAlchemy keeps what it compiled with the engine, for the engine's dialect. Each tower of a test has an engine of its
own, and compiling its statements anew took a tenth of the time of the tests over HTTP.
"""

from typing import Any, Final

from sqlalchemy.ext.asyncio import AsyncEngine, create_async_engine
from sqlalchemy.util import LRUCache

from server.storage import database

STATEMENTS: Final = 2000
"""More than the towers have, of all versions that tests start."""


class _Compiled(LRUCache[Any, Any]):
    """Does not ask which engine's dialect it was: all of them are alike."""

    def get(self, key: Any, default: Any = None) -> Any:
        return super().get(key[1:], default)

    def __setitem__(self, key: Any, value: Any) -> None:
        super().__setitem__(key[1:], value)


def share_compiled_statements() -> None:
    """For the engines made from now on."""
    compiled = _Compiled(STATEMENTS)

    def create(*arguments: Any, **options: Any) -> AsyncEngine:
        engine = create_async_engine(*arguments, **options)
        if engine.dialect.name == "sqlite":
            engine.sync_engine._compiled_cache = compiled
        return engine

    database.create_async_engine = create  # type: ignore[assignment]
