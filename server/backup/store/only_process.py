"""Holds the lock of the tower while a command changes a whole database: no tower runs, and none starts meanwhile."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from server.kernel.clock import utc_now
from server.runtime.background import in_background
from server.storage.database import Database
from server.towers.store.tower_lock import TowerLock


@asynccontextmanager
async def only_process(database: Database, *, one_transaction: bool = False) -> AsyncIterator[None]:
    """Raises TowerLockHeld if a tower runs on the database; in the block, writing raises LockLost if another process
    has become the tower after all. `one_transaction`: the block writes all the time, so that on SQLite nobody else can,
    and the lock needs no renewal."""
    lock = TowerLock(database.engine.url.render_as_string(hide_password=False), clock=utc_now)
    lock.address = "no address: a command at work"
    try:
        await lock.take(waits=False)
        database.guard = lock.check
        if one_transaction and database.engine.dialect.name == "sqlite":
            yield
        else:
            async with in_background("tower lock", lock.keep):
                yield
    finally:
        database.guard = None
        await lock.release()
