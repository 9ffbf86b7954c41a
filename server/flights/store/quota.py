"""Keeps recorded flights within their budget, which owners share (`file_budget`): the oldest one of the largest account
that is over goes first, never one that is being recorded. No owner pushes out another's."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Mapping
from datetime import datetime
from typing import Final

import structlog

from server.audit.store.action import AuditAction
from server.audit.store.trail import TOWER
from server.flights.core.refusals import FlightRunning, UnknownFlight
from server.flights.store import catalogue
from server.flights.store.files import FlightFiles, FoundFlight
from server.flights.store.tables import FlightRow
from server.kernel.clock import Clock
from server.storage.database import Database
from server.storage.file_accounts import FileAccounts
from server.storage.file_budget import NOBODY, Account, share_bytes, to_shrink

AT_ONCE: Final = 50
_log = structlog.get_logger(__name__)


class FlightQuota:
    """`kept_bytes`: of flights that are over, at the last count. `strays`: files of no drone that the database knows,
    oldest first; they go before all others. `removed`: flights, since the tower started."""

    def __init__(
        self, *, database: Database, clock: Clock, files: FlightFiles, budget_bytes: int, accounts: FileAccounts
    ) -> None:
        self._database = database
        self._clock = clock
        self._files = files
        self._accounts = accounts
        self.budget_bytes = budget_bytes
        self.kept_bytes = 0
        self.strays: list[FoundFlight] = []
        self.removed = 0
        self._one_at_a_time = asyncio.Lock()

    async def make_space(self, running: Mapping[int, int]) -> frozenset[int]:
        """`running`: bytes of the flights that are being recorded, by drone. Returns the drones whose flights must end,
        because their account has used up its share with flights that still run."""
        async with self._one_at_a_time:
            accounts = self._accounts()
            async with self._database.reading() as session:
                over = await catalogue.bytes_over(session, self._files.id)
            removable = Counter[Account]()
            drones: dict[Account, list[int]] = {}
            for drone_id, size in over.items():
                account = accounts.get(drone_id, NOBODY)
                removable[account] += size
                drones.setdefault(account, []).append(drone_id)
            used = Counter(removable)
            for drone_id, size in running.items():
                used[accounts.get(drone_id, NOBODY)] += size
            stray_bytes = sum(one.size_bytes for one in self.strays)
            while self.strays and used.total() + stray_bytes > self.budget_bytes:
                stray_bytes -= await self._remove_stray(self.strays[0])
            while used.total() > self.budget_bytes:
                account_over = to_shrink(used, removable, coming=None, budget_bytes=self.budget_bytes)
                if account_over is None:
                    break
                beyond_share = used[account_over] - int(share_bytes(used, budget_bytes=self.budget_bytes))
                wanted_bytes = min(used.total() - self.budget_bytes, beyond_share)
                gone = await self._remove_oldest(drones[account_over], wanted_bytes)
                if not gone:
                    gone = removable[account_over]  # rows that disappeared meanwhile
                used[account_over] -= gone
                removable[account_over] = max(0, removable[account_over] - gone)
            self.kept_bytes = removable.total() + stray_bytes
            if used.total() <= self.budget_bytes:
                return frozenset()
            share = share_bytes(used, budget_bytes=self.budget_bytes)
            return frozenset(drone_id for drone_id in running if used[accounts.get(drone_id, NOBODY)] > share)

    async def remove_older(self, before: datetime, at_most: int) -> int:
        """Removes flights that began before then and are over. Returns how many."""
        async with self._one_at_a_time:
            async with self._database.reading() as session:
                rows = await catalogue.over_before(session, self._files.id, before, at_most)
            strays = [one for one in self.strays if one.kept_at < before.timestamp()][: at_most - len(rows)]
            for row in rows:
                await self._remove(row)
            for stray in strays:
                await self._remove_stray(stray)
            return len(rows) + len(strays)

    async def _remove_oldest(self, drone_ids: list[int], wanted_bytes: int) -> int:
        async with self._database.reading() as session:
            rows = await catalogue.oldest_over(session, self._files.id, drone_ids, AT_ONCE)
        gone = 0
        for row in rows:
            await self._remove(row)
            gone += row.size_bytes + catalogue.OVERHEAD_BYTES
            if gone >= wanted_bytes:
                break
        return gone

    async def _remove(self, row: FlightRow) -> None:
        action = AuditAction(by=TOWER, at=self._clock())
        try:
            async with self._database.writing() as session:
                await catalogue.remove(session, row.id, "flight.removed", action)
        except (UnknownFlight, FlightRunning):
            return
        self.removed += 1
        await asyncio.to_thread(self._files.remove, row.drone_id, row.file)

    async def _remove_stray(self, stray: FoundFlight) -> int:
        await asyncio.to_thread(self._files.remove, stray.drone_id, stray.file)
        self.strays.remove(stray)
        _log.warning("flight_not_in_the_database_removed", drone_id=stray.drone_id, size_bytes=stray.size_bytes)
        return stray.size_bytes
