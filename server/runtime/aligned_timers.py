"""Periodic work runs on common ticks, so that one wake-up of the process serves all of it.

Waking the process costs a fifth of a millisecond, whatever it then does: the timers of the hub, of the server and of
fifty viewers' sign-ins, each at its own time, were most of the load of an idle tower.
"""

import asyncio
import math
import time
from collections.abc import Callable
from typing import Final

BEAT_S: Final = 0.1


async def rest(about_s: float) -> float:
    """Sleeps until the tick nearest to so many seconds from now (exactly that long if it is less than a tick). Returns
    when it was due, in monotonic seconds."""
    now = time.monotonic()
    due_at = _due_at(now, about_s)
    await asyncio.sleep(_rounded(due_at - now))
    return due_at


def _due_at(now: float, about_s: float) -> float:
    return now + about_s if about_s < BEAT_S else round((now + about_s) / BEAT_S) * BEAT_S


def _rounded(delay_s: float) -> float:
    """Event loops round to milliseconds: rounded up, all tasks that wait for a tick wake together."""
    return math.ceil(delay_s * 1000) / 1000


class SharedChecks:
    """Checks the conditions of many tasks together, once a second: a task that wakes for its own check costs about
    forty microseconds each time, and fifty viewers' sign-ins were a tenth of the cost of their video."""

    def __init__(self, every_s: float = 1.0) -> None:
        self._every_s = every_s
        self._waiting: dict[asyncio.Future[None], Callable[[], bool]] = {}
        self._timer: asyncio.TimerHandle | None = None

    async def until(self, due: Callable[[], bool]) -> None:
        """Returns at the first check for which `due` is true; raises what it raises."""
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
