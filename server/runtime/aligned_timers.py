"""Work that comes back again and again does so on common beats: one wake-up of the process serves all of it.

A process that sleeps and is woken pays a fifth of a millisecond for it, whatever it then does: the clock of the hub,
the server's own and the sign-in of fifty viewers, each at moments of its own, were most of what an idle tower used.
"""

import asyncio
import math
import time
from collections.abc import Callable
from typing import Final

BEAT_S: Final = 0.1


async def rest(about_s: float) -> float:
    """Sleeps until the aligned tick nearest to this many seconds from now (exactly this long if that is less than a
    tick). Returns when it was due, in monotonic seconds."""
    now = time.monotonic()
    due_at = _due_at(now, about_s)
    await asyncio.sleep(_rounded(due_at - now))
    return due_at


def _due_at(now: float, about_s: float) -> float:
    return now + about_s if about_s < BEAT_S else round((now + about_s) / BEAT_S) * BEAT_S


def _rounded(delay_s: float) -> float:
    """Loops round to milliseconds: rounded up, all who wait for a beat wait for the same one."""
    return math.ceil(delay_s * 1000) / 1000


class SharedChecks:
    """Checks the conditions of many tasks once a second, all in one go. A task that wakes up to check costs some forty
    microseconds each time, and fifty viewers' sign-ins were a tenth of the cost of their video."""

    def __init__(self, every_s: float = 1.0) -> None:
        self._every_s = every_s
        self._waiting: dict[asyncio.Future[None], Callable[[], bool]] = {}
        self._timer: asyncio.TimerHandle | None = None

    async def until(self, due: Callable[[], bool]) -> None:
        """Returns at the first look that finds this `due`; raises what it raises."""
        future = asyncio.get_running_loop().create_future()
        self._waiting[future] = due
        if self._timer is None:
            self._plan()
        try:
            await future
        finally:
            del self._waiting[future]

    def _plan(self) -> None:
        now = time.monotonic()
        delay_s = _rounded(_due_at(now, self._every_s) - now)
        self._timer = asyncio.get_running_loop().call_later(delay_s, self._check)

    def _check(self) -> None:
        self._timer = None
        for future, due in self._waiting.items():
            if future.done():
                continue
            try:
                if due():
                    future.set_result(None)
            except Exception as fault:
                future.set_exception(fault)
        if not all(future.done() for future in self._waiting):
            self._plan()
