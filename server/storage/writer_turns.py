"""The order of those who wait to write to a database that takes one writer at a time.

Changes of who flies a drone go first. Everybody else has turns by person, so that one who writes a lot waits for it
alone.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from contextvars import ContextVar
from typing import Final

from server.kernel.fair_queue import FairQueue

_person: Final[ContextVar[int]] = ContextVar("writing_person", default=0)
_MOST: Final = 100_000
"""Each waits for two seconds at most and then leaves: there is no need to drop any."""


def write_as(user_id: int) -> None:
    """From here on, in this task and those that it starts, this person writes; otherwise it is the tower itself."""
    _person.set(user_id)


def writing_person() -> int:
    """Who writes in this task; 0: the tower itself."""
    return _person.get()


class WriterTurns:
    """One for a database."""

    def __init__(self) -> None:
        self._is_taken = False
        self._first: deque[asyncio.Future[None]] = deque()
        self._others: FairQueue[int, asyncio.Future[None]] = FairQueue(_MOST)

    @asynccontextmanager
    async def turn(self, within_s: float, *, first: bool) -> AsyncIterator[None]:
        """Raises TimeoutError. `first`: before all who are not."""
        await self._acquire(within_s, first=first)
        try:
            yield
        finally:
            self._release()

    async def _acquire(self, within_s: float, *, first: bool) -> None:
        if not self._is_taken:
            self._is_taken = True
            return
        mine: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        if first:
            self._first.append(mine)
        else:
            self._others.put(_person.get(), mine)
        try:
            async with asyncio.timeout(within_s):
                await mine
        except BaseException:
            if mine.done() and not mine.cancelled():
                self._release()  # it came at the very moment of the end
            raise

    def _release(self) -> None:
        while self._first or len(self._others):
            following = self._first.popleft() if self._first else self._others.pop()[1]
            if not following.done():
                following.set_result(None)
                return
        self._is_taken = False
