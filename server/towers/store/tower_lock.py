"""The lock that makes one process the tower of its database (docs/adr/0011-one-tower-on-one-database.md).

It is a row that is changed only by compare-and-set. On SQLite a locked file beside the database shows at once that its
owner has died; without it, and for a stopped owner, the lock becomes free when it is not renewed for a while.
"""

from __future__ import annotations

import asyncio
import os
import secrets
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Final, cast

import structlog
from sqlalchemy import Table, Update, bindparam, select, update
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncSession

from server.kernel.clock import Clock
from server.runtime.aligned_timers import rest
from server.runtime.life_file import LifeFile, has_died
from server.storage.database import Database, LockLost, open_database, sqlite_file
from server.storage.repeated_statement import RepeatedStatement
from server.towers.core.tower_lease import (
    CHECK_EVERY_S,
    HOLD_AFTER_S,
    NOBODY,
    RENEW_EVERY_S,
    RENEW_WITHIN_S,
    LockBelief,
    LockState,
    LockWatch,
)
from server.towers.store.tower_lock_tables import THE_ROW, TowerLockRow

_log = structlog.get_logger(__name__)
QUESTION_WITHIN_S: Final = 0.7
REACHED_WITHIN_S: Final = 10.0
"""A starting tower gives up if the database has not responded for this long."""
LOG_EVERY_CHECKS: Final = 4
"""A waiting process logs this about once a second."""
TIMER_EARLY_S: Final = 0.05
"""The event loop uses a different clock, and its timers may fire early."""
_NOT_MINE: Final = -1
_CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)


def awake_or_asleep_s() -> float:
    """Seconds of a clock that nobody sets, and that also runs while the machine sleeps if the system has one."""
    return time.clock_gettime(_CLOCK)


class TowerLockHeld(Exception):
    """Another process is the tower. The message says which, and what to do."""

    def __init__(self, state: LockState) -> None:
        super().__init__(
            f"another tower serves this database: {state.in_words()}. Stop it, or start this one with --standby"
        )


class TowerLock:
    """The lock of one process. It has its own connections, so that no other work delays a renewal."""

    def __init__(self, database_url: str, *, clock: Clock, now: Callable[[], float] = awake_or_asleep_s) -> None:
        self._url = database_url
        self._clock = clock
        self._now = now
        self._owner = secrets.token_hex(16)
        self._database: Database | None = None
        self._belief: LockBelief | None = None
        self._life: LifeFile | None = None
        self._beside = sqlite_file(database_url)
        self.address = ""
        """The address of this tower, for processes that find the lock held."""
        self.on_lost: Callable[[str], None] = lambda words: None
        """Called once, immediately, when another process turns out to have the lock; with text for people."""
        self.on_running_out: Callable[[], None] = lambda: None
        """Called once, early enough for drones to hold before the lease runs out: the database does not respond, and
        another process waits for the lock."""
        self._running_out: asyncio.TimerHandle | None = None
        self.lost_words = ""
        self._answered = True
        self._attempted = asyncio.Event()
        """Set at the end of the renewal that comes next, and replaced."""
        self._ending: set[asyncio.Task[int]] = set()
        table = cast("Table", TowerLockRow.__table__)
        self._renewal: RepeatedStatement | None = None
        self._renewing = (
            table.update()
            .where(table.c.id == THE_ROW, table.c.owner == self._owner)
            .values(renewals=table.c.renewals + 1, renewed_at=bindparam("at"))
            .returning(table.c.looks)
        )

    @property
    def is_taken(self) -> bool:
        return self._belief is not None

    def may_act(self) -> bool:
        """Whether this process may still act as the tower, as far as it can know without the database."""
        return self._belief is not None and self._belief.may_act(self._now())

    async def confirmed(self) -> bool:
        """Whether this process may still act as the tower. If it was stopped, or its machine is busy, and no other
        process waits for the lock, waits for the next renewal, `RENEW_WITHIN_S` at most."""
        with suppress(TimeoutError):
            async with asyncio.timeout(RENEW_WITHIN_S):
                while not self.may_act() and self._belief is not None and self._belief.is_unsure(self._now()):
                    await self._attempted.wait()
        return self.may_act()

    @property
    def is_renewed(self) -> bool:
        """Whether the last attempt to write the renewal succeeded: a write test, twice a second."""
        return self._answered and self.may_act()

    async def take(self, *, waits: bool) -> None:
        """Returns with the lock taken. `waits`: waits while another process has it. Raises TowerLockHeld, and, unless
        it waits, the database's error if that lasts."""
        watch, announced, rounds = LockWatch(), "", count()
        gives_up_at = self._now() + REACHED_WITHIN_S
        while True:
            try:
                state = await self._read()
                dead = self._beside is not None and has_died(self._life_path(state.owner))
                # Its own if the response to the last attempt was lost.
                free = watch.may_take(state, self._now()) or dead or state.owner == self._owner
                if free and await self._take_from(state):
                    return
            except (SQLAlchemyError, OSError) as error:
                if not waits and self._now() >= gives_up_at:
                    raise
                watch.unanswered()
                _log.warning("tower_lock_not_read", error=type(error).__name__)
            else:
                if watch.is_alive and not waits:
                    raise TowerLockHeld(state)
                if waits and not state.is_free and announced != state.owner:
                    announced = state.owner
                    _log.info("standby", tower=state.in_words())
            if next(rounds) % LOG_EVERY_CHECKS == 0:
                await self._say_that_it_waits()
            await asyncio.sleep(CHECK_EVERY_S)

    async def keep(self) -> None:
        """Renews the lock until it is lost or the call is cancelled."""
        answers = True
        while await self._renew_once():
            assert self._belief is not None
            self._attempted.set()
            self._attempted = asyncio.Event()
            if answers != self._answered:
                answers = self._answered
                (_log.info if answers else _log.error)("tower_lock_renewed" if answers else "tower_lock_not_renewed")
            await rest(RENEW_EVERY_S)

    async def release(self) -> None:
        """Another process may become the tower from now on. Does nothing if the lock is not ours."""
        if self._belief is not None and not self._belief.is_lost:
            with suppress(SQLAlchemyError, OSError):
                async with asyncio.timeout(RENEW_WITHIN_S), self._open().writing() as session:
                    await session.execute(self._mine().values(owner=NOBODY, address="", pid=0))
        self._belief = None
        if self._running_out is not None:
            self._running_out.cancel()
            self._running_out = None
        if self._ending:
            await asyncio.wait(self._ending, timeout=RENEW_WITHIN_S)
        if self._life is not None:
            self._life.unlock()
        if self._database is not None:
            await self._database.close()
            self._database, self._renewal = None, None

    async def check(self, session: AsyncSession) -> None:
        """Inside a transaction that is about to write: raises LockLost if another process is the tower. On PostgreSQL
        the row stays locked until the transaction ends."""
        if self._belief is None:
            return
        if not self._belief.is_lost:
            row = (
                select(TowerLockRow.owner).where(TowerLockRow.id == THE_ROW).with_for_update(read=True, key_share=True)
            )
            if await session.scalar(row) == self._owner:
                return
            await self._lose()
        raise LockLost("another process is the tower of this database")

    async def _renew_once(self) -> bool:
        """Returns False if the lock is lost."""
        assert self._belief is not None
        if self._belief.is_lost:
            return False
        began_at = self._now()
        attempt = asyncio.create_task(self._write_renewal())
        try:
            # Does not wait for the end of a hanging connection: the next attempt must not be late.
            await asyncio.wait({attempt}, timeout=RENEW_WITHIN_S)
        finally:
            if not attempt.done():
                attempt.cancel()
                self._ending.add(attempt)
                attempt.add_done_callback(self._ended)
        try:
            looks = attempt.result() if attempt not in self._ending else None
        except (SQLAlchemyError, OSError):
            looks = None
        self._answered = looks is not None
        if looks is None:
            self._belief.unanswered(began_at)
        elif looks == _NOT_MINE:
            await self._lose()
            return False
        else:
            self._belief.renewed(began_at, looks)
            self._watch_lease(began_at)
        return True

    def _watch_lease(self, began_at: float) -> None:
        if self._running_out is not None:
            self._running_out.cancel()
        self._running_out = asyncio.get_running_loop().call_later(began_at + HOLD_AFTER_S - self._now(), self._runs_out)

    def _runs_out(self) -> None:
        self._running_out = None
        belief = self._belief
        if belief is not None and not belief.is_lost and belief.must_hold(self._now() + TIMER_EARLY_S):
            _log.error("tower_lock_runs_out")
            self.on_running_out()

    async def _write_renewal(self) -> int:
        """Returns how often other processes have checked the lock; _NOT_MINE if it is not ours."""
        if self._renewal is None:
            self._renewal = self._open().repeated(self._renewing)
        looks = await self._renewal.scalar(at=self._clock())
        return _NOT_MINE if looks is None else int(looks)

    def _ended(self, attempt: asyncio.Task[int]) -> None:
        self._ending.discard(attempt)
        if not attempt.cancelled():
            attempt.exception()  # nobody else retrieves it

    async def _lose(self) -> None:
        belief = self._belief
        if belief is None or belief.is_lost:
            return
        belief.is_lost = True
        who = ""
        with suppress(SQLAlchemyError, OSError):
            # Read only: a transaction of ours may have the write lock, and wait for this.
            async with asyncio.timeout(RENEW_WITHIN_S), self._open().reading() as session:
                row = await session.get(TowerLockRow, THE_ROW)
                who = f": {state_of(row).in_words()}" if row is not None else ""
        self.lost_words = (
            f"another process has become the tower of this database{who}. This one had not renewed its lock for "
            f"{belief.silent_for_s(self._now()):.1f} s; it has closed every link and ends"
        )
        _log.error("tower_lock_lost", words=self.lost_words)
        self.on_lost(self.lost_words)

    async def _read(self) -> LockState:
        """Reads within a writing transaction: a process must not become the tower of a database that accepts no
        writes."""
        async with asyncio.timeout(RENEW_WITHIN_S), self._open().writing() as session:
            row = await session.get(TowerLockRow, THE_ROW)
            if row is None:  # the table was emptied by hand
                row = TowerLockRow(id=THE_ROW, owner=NOBODY, renewals=0, host="", pid=0, address="")
                session.add(row)
            return state_of(row)

    async def _say_that_it_waits(self) -> None:
        with suppress(SQLAlchemyError, OSError):
            async with asyncio.timeout(RENEW_WITHIN_S), self._open().writing() as session:
                row = update(TowerLockRow).where(TowerLockRow.id == THE_ROW)
                await session.execute(row.values(looks=TowerLockRow.looks + 1))

    async def _take_from(self, state: LockState) -> bool:
        """Takes the lock by compare-and-set. False if another process was faster, or the owner has renewed it after
        all."""
        life = LifeFile(self._life_path(self._owner)) if self._beside is not None else None
        if life is not None and self._life is None:
            life.lock()
            self._life = life
        began_at = self._now()
        row = select(TowerLockRow).where(TowerLockRow.id == THE_ROW).with_for_update()
        async with asyncio.timeout(RENEW_WITHIN_S), self._open().writing() as session:
            found = (await session.scalars(row)).one()
            if (found.owner, found.renewals) != (state.owner, state.renewals):
                return False
            found.owner, found.renewals = self._owner, 0
            found.host, found.pid, found.address = socket.gethostname()[:255], os.getpid(), self.address[:255]
            found.taken_at = found.renewed_at = self._clock()
        self._belief = LockBelief(began_at)
        if not state.is_free:
            _log.warning("tower_taken_over", tower=state.in_words())
            if self._beside is not None and has_died(self._life_path(state.owner)):
                self._life_path(state.owner).unlink(missing_ok=True)
        return True

    def _mine(self) -> Update:
        return update(TowerLockRow).where(TowerLockRow.id == THE_ROW, TowerLockRow.owner == self._owner)

    def _life_path(self, owner: str) -> Path:
        assert self._beside is not None
        return self._beside.with_name(f"{self._beside.name}.tower-{owner}")

    def _open(self) -> Database:
        if self._database is None:
            self._database = open_database(self._url, timeout_s=QUESTION_WITHIN_S)
        return self._database


def state_of(row: TowerLockRow) -> LockState:
    return LockState(row.owner, row.renewals, row.host, row.pid, row.address, row.taken_at, row.renewed_at)
