"""Threads for work that may wait for somebody else's server: a few at once, and fewer for each owner.

A place is free again when its thread has ended, not when its caller has stopped waiting. The threads are daemons: a
tower that stops does not wait for them.
"""

from __future__ import annotations

import asyncio
import threading
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from typing import Final

MAX_AT_ONCE: Final = 6
MAX_OF_ONE: Final = 2
"""Of one owner, so that slow servers of one leave room for the others."""


class SendingThreads:
    """One instance per tower; used in one event loop."""

    def __init__(self) -> None:
        self._running: Counter[int] = Counter()

    @property
    def room(self) -> int:
        """How many more may run, whoever they belong to."""
        return MAX_AT_ONCE - self._running.total()

    @property
    def full(self) -> list[int]:
        """Owners who have as many as one may have."""
        return [owner for owner, count in self._running.items() if count >= MAX_OF_ONE]

    def start(self, owner: int, work: Callable[[], None]) -> asyncio.Future[None]:
        """Call only if there is room and the owner is not full. The future has the outcome of `work`."""
        loop = asyncio.get_running_loop()
        outcome: asyncio.Future[None] = loop.create_future()
        self._running[owner] += 1

        def ended(error: Exception | None) -> None:
            self._running[owner] -= 1
            if not self._running[owner]:
                del self._running[owner]
            if outcome.done():
                return  # nobody waits any more
            if error is None:
                outcome.set_result(None)
            else:
                outcome.set_exception(error)

        def run() -> None:
            error: Exception | None = None
            try:
                work()
            except Exception as raised:
                error = raised
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(ended, error)

        threading.Thread(target=run, name="alert delivery", daemon=True).start()
        return outcome
