"""Claims that come at the same time share a transaction: after the end of a tower thousands of agents link at once.

A claim that comes alone has a transaction of its own, at once. Claims of a transaction that failed are made again one
by one, so that one locked drone does not keep the others.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Final, Generic, TypeVar

from wire.ids import DroneId

MAX_TRANSACTIONS: Final = 4
"""At the same time. Further claims wait, and share the next one."""
MAX_DRONES: Final = 50
"""In one transaction: it locks their leases, and has a deadline."""
_Claimed = TypeVar("_Claimed")


class ClaimBatches(Generic[_Claimed]):
    """`claim_all`: claims these drones in one transaction, or none of them."""

    def __init__(self, claim_all: Callable[[list[DroneId]], Awaitable[dict[DroneId, _Claimed]]]) -> None:
        self._claim_all = claim_all
        self._slots = asyncio.Semaphore(MAX_TRANSACTIONS)
        self._waiting: dict[asyncio.Future[_Claimed | None], DroneId] = {}
        """In no transaction yet, oldest first."""
        self._one_by_one: set[DroneId] = set()

    async def claim(self, drone_id: DroneId) -> _Claimed | None:
        """Returns what `claim_all` has for this drone, and raises what it raises."""
        mine: asyncio.Future[_Claimed | None] = asyncio.get_running_loop().create_future()
        self._waiting[mine] = drone_id
        try:
            async with self._slots:
                if mine in self._waiting:  # else an earlier one has taken it along
                    await self._carry_out(self._next(mine))
            return await mine
        finally:
            self._waiting.pop(mine, None)
            mine.cancel()

    def _next(self, mine: asyncio.Future[_Claimed | None]) -> dict[asyncio.Future[_Claimed | None], DroneId]:
        """The claims of the next transaction."""
        taken = {mine: self._waiting.pop(mine)}
        if taken[mine] not in self._one_by_one:
            for future, drone_id in list(self._waiting.items()):
                if len(taken) == MAX_DRONES:
                    break
                if drone_id not in self._one_by_one:
                    taken[future] = self._waiting.pop(future)
        return taken

    async def _carry_out(self, taken: dict[asyncio.Future[_Claimed | None], DroneId]) -> None:
        drone_ids = sorted(set(taken.values()))  # towers that claim the same drones lock them in the same order
        try:
            found = await self._claim_all(drone_ids)
        except asyncio.CancelledError:
            for future in taken:
                future.cancel()
            raise
        except Exception as error:
            if len(drone_ids) > 1:
                self._one_by_one.update(drone_ids)
            for future in taken:
                if not future.done():
                    future.set_exception(error)
            return
        self._one_by_one.difference_update(drone_ids)
        for future, drone_id in taken.items():
            if not future.done():
                future.set_result(found.get(drone_id))
