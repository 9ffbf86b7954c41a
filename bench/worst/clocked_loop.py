"""How long each piece of work keeps an event loop, by the processor time of its thread.

Processor time, because another thread or another program on the machine is not what is measured. asyncio's own loop,
because uvloop's callbacks cannot be seen from outside.
"""

from __future__ import annotations

import asyncio
import time
from asyncio import events
from collections.abc import Iterator
from contextlib import contextmanager


class ClockedLoop:
    """`longest_s`: of a piece of work since `begin`."""

    def __init__(self) -> None:
        self.longest_s = 0.0
        self.whole_s = 0.0

    def begin(self) -> None:
        self.longest_s = self.whole_s = 0.0

    @contextmanager
    def clocking(self, loop: asyncio.AbstractEventLoop) -> Iterator[None]:
        """Until the block ends. Call it in the thread of the loop."""
        as_it_was = events.Handle._run

        def clocked(handle: events.Handle) -> None:
            if handle._loop is not loop:  # type: ignore[attr-defined]
                as_it_was(handle)
                return
            began = time.thread_time()
            as_it_was(handle)
            took_s = time.thread_time() - began
            self.whole_s += took_s
            self.longest_s = max(self.longest_s, took_s)

        events.Handle._run = clocked  # type: ignore[method-assign, assignment]
        try:
            yield
        finally:
            events.Handle._run = as_it_was  # type: ignore[method-assign]
