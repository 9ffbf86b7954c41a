"""Keeps recordings within their budget, which owners share (`file_budget`): the oldest one of the largest account that
is over goes first, never one that runs or is being finished. Files unknown to the database count too, and are removed
by age like all others."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Final

import structlog

from server.audit.store.action import AuditAction
from server.audit.store.trail import TOWER
from server.kernel.clock import Clock
from server.storage.database import Database
from server.storage.file_accounts import FileAccounts
from server.storage.file_budget import NOBODY, Account, share_bytes, to_shrink
from server.video.core.recordings.notifier import RecordingNotifier
from server.video.store import catalogue
from server.video.store.store import RecordingStore, Stray
from server.video.store.tables import RecordingRow
from wire.video import MAX_UNIT_BYTES

MIN_ROOM_BYTES: Final = MAX_UNIT_BYTES
"""Minimum free space to begin a recording."""
AT_ONCE: Final = 100
"""Rows read together: creating objects for thousands would block the tower's loop."""


_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class _Kept:
    what: RecordingRow | Stray
    size_bytes: int
    kept_at: float


@dataclass
class _Bytes:
    """By account. `drones`: of each account, those with recordings that are over."""

    used: Counter[Account]
    removable: Counter[Account]
    drones: dict[Account, list[int]]


class RecordingQuota:
    """`in_use`: bytes of running recordings, by drone. `kept_bytes`: of all that are over, at the last count; `used`:
    of all, by account. `strays`: files unknown to the database, oldest first."""

    def __init__(
        self,
        *,
        database: Database,
        clock: Clock,
        store: RecordingStore,
        notifier: RecordingNotifier,
        budget_bytes: int,
        accounts: FileAccounts,
    ) -> None:
        self._database = database
        self._clock = clock
        self._store = store
        self._notifier = notifier
        self._accounts = accounts
        self.budget_bytes = budget_bytes
        self.in_use: Callable[[], Mapping[int, int]] = dict
        self.kept_bytes = 0
        self.used: Mapping[Account, int] = {}
        self.strays: list[Stray] = []
        self._one_at_a_time = asyncio.Lock()

    async def make_space(self, coming_bytes: int, drone_id: int | None = None) -> bool:
        """Removes files until so many more bytes of this drone fit. Returns whether they fit now, also on the disk."""
        async with self._one_at_a_time:
            accounts = self._accounts()
            there = await self._count(accounts)
            coming = None if drone_id is None else accounts.get(drone_id, NOBODY)
            there.used[NOBODY if coming is None else coming] += coming_bytes
            fits = await self._shrink(there, accounts, coming)
            self.kept_bytes, self.used = there.removable.total(), dict(there.used)
            return fits and await asyncio.to_thread(self._store.has_room, coming_bytes)

    async def remove_older(self, before: datetime, at_most: int) -> int:
        """Removes recordings that began before then and are over, and files unknown to the database that are as old.
        Returns how many."""
        async with self._one_at_a_time:
            async with self._database.reading() as session:
                rows = await catalogue.over_before(session, self._store.id, before, at_most=at_most)
            strays = [one for one in self.strays if one.kept_at < before.timestamp()][: at_most - len(rows)]
            for row in rows:
                await self._remove(row)
            for stray in strays:
                await self._remove_stray(stray)
            return len(rows) + len(strays)

    def hogs_most(self, drone_id: int) -> int:
        """Returns the bytes that the owner of this drone stores, at the last count: the largest account gives way
        first."""
        return self.used.get(self._accounts().get(drone_id, NOBODY), 0)

    def stray_bytes(self) -> int:
        """Bytes of files unknown to the database."""
        return sum(one.size_bytes for one in self.strays)

    async def _count(self, accounts: Mapping[int, Account]) -> _Bytes:
        async with self._database.reading() as session:
            finishing, over = await catalogue.bytes_of_store(session, self._store.id)
        used, removable = Counter[Account](), Counter[Account]()
        drones: dict[Account, list[int]] = {}
        for drone_id, size in over.items():
            account = accounts.get(drone_id, NOBODY)
            removable[account] += size
            drones.setdefault(account, []).append(drone_id)
        for stray in self.strays:
            removable[accounts.get(stray.drone_id, NOBODY)] += stray.size_bytes
        used.update(removable)
        for sizes in (finishing, self.in_use()):
            for drone_id, size in sizes.items():
                used[accounts.get(drone_id, NOBODY)] += size
        return _Bytes(used, removable, drones)

    async def _shrink(self, there: _Bytes, accounts: Mapping[int, Account], coming: Account | None) -> bool:
        """Returns whether the rest is within the budget, or the new file is within its account's share."""
        while there.used.total() > self.budget_bytes:
            account = to_shrink(there.used, there.removable, coming=coming, budget_bytes=self.budget_bytes)
            if account is None:
                share = share_bytes(there.used, budget_bytes=self.budget_bytes)
                return coming is not None and there.used[coming] <= share
            if not await self._remove_oldest(account, there, accounts, coming):
                there.used[account] -= there.removable.pop(account)  # rows that disappeared meanwhile
        return True

    async def _remove_oldest(
        self, account: Account, there: _Bytes, accounts: Mapping[int, Account], coming: Account | None
    ) -> int:
        """Removes some files of an account. Returns how many."""
        async with self._database.reading() as session:
            drones = there.drones.get(account, ())
            rows = await catalogue.oldest_over(session, self._store.id, drones, most=AT_ONCE)
        # Rows beyond this batch may be older than a stray that is younger than these.
        until = rows[-1].began_at.timestamp() if len(rows) == AT_ONCE else float("inf")
        oldest = [_Kept(row, row.size_bytes, row.began_at.timestamp()) for row in rows]
        oldest += [
            _Kept(one, one.size_bytes, one.kept_at)
            for one in self.strays
            if one.kept_at <= until and accounts.get(one.drone_id, NOBODY) == account
        ]
        gone = 0
        for one in sorted(oldest, key=lambda one: one.kept_at):
            if there.used.total() <= self.budget_bytes:
                break
            if to_shrink(there.used, there.removable, coming=coming, budget_bytes=self.budget_bytes) != account:
                break
            if isinstance(one.what, Stray):
                await self._remove_stray(one.what)
            else:
                await self._remove(one.what)
            there.used[account] -= one.size_bytes
            there.removable[account] -= one.size_bytes
            gone += 1
        return gone

    async def _remove_stray(self, stray: Stray) -> None:
        await asyncio.to_thread(self._store.remove_stray, stray)
        self.strays.remove(stray)
        _log.warning("recording_not_in_the_database_removed", file=str(stray.path), size_bytes=stray.size_bytes)

    async def _remove(self, row: RecordingRow) -> None:
        action = AuditAction(by=TOWER, at=self._clock())
        async with self._database.writing() as session:
            removed = await catalogue.remove_to_make_space(session, row.id, action=action)
        if removed is not None:
            await asyncio.to_thread(self._store.remove, removed.drone_id, removed.file)
            self._notifier.publish("removed", catalogue.view_of(removed))
