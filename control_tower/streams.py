"""What waits for a reader, the newest value only or all values up to a bound; and waiting that nothing interrupts."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Coroutine
from typing import Any, Final, Generic, TypeVar

from control_tower.errors import TooSlow, TowerError

T = TypeVar("T")

MAX_EVENTS: Final = 1000
"""Waiting for one reader: a busy minute of a large squad. Then the reader gets TooSlow, since a gap would mislead."""


class Stream(Generic[T]):
    """An asynchronous iterator that another part feeds. `newest_only`: a value replaces the one that still waits."""

    def __init__(self, *, newest_only: bool) -> None:
        self._newest_only = newest_only
        self._waiting: deque[T] = deque()
        self._wake = asyncio.Event()
        self._error: BaseException | None = None

    def put(self, value: T) -> None:
        """Adds a value, unless the stream has ended."""
        if self._error is not None:
            return
        if self._newest_only:
            self._waiting.clear()
        elif len(self._waiting) >= MAX_EVENTS:
            self.end(TooSlow(f"{MAX_EVENTS} events waited, and more came"))
            return
        self._waiting.append(value)
        self._wake.set()

    def end(self, error: BaseException) -> None:
        """Ends it: the reader gets the error behind the values that wait."""
        self._error = self._error or error
        self._wake.set()

    def __aiter__(self) -> AsyncIterator[T]:
        return self

    async def __anext__(self) -> T:
        while not self._waiting:
            if self._error is not None:
                raise self._error
            self._wake.clear()
            await self._wake.wait()
        return self._waiting.popleft()


async def uninterrupted(work: Coroutine[Any, Any, object]) -> None:
    """Waits for the end of short work even if this task is cancelled meanwhile, and raises the CancelledError after it.
    With several flights in one task, the loss of one must not interrupt the release of another."""
    task = asyncio.ensure_future(work)
    cancelled: asyncio.CancelledError | None = None
    while not task.done():
        try:
            await asyncio.wait({task})
        except asyncio.CancelledError as error:
            cancelled = error
    if cancelled is not None:
        raise cancelled
    task.result()


class Closed(TowerError):
    """The program has closed the connection itself."""
