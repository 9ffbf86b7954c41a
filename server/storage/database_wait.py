"""Limits how long one caller waits for a failing database: all its transactions together, not each one.

A request queries the database several times: for its sender, for its object, for its response. If each query waited for
its own timeout, the response would come after several of them.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Final

ENDS_WITHIN_S: Final = 0.2
"""Time to end after being given up. The driver asks a frozen server to cancel its work, and waits for the response."""


class DatabaseWait:
    """The remaining wait of one caller. Only failures use it up: a working database is not cut short by earlier
    work."""

    def __init__(self, at_most_s: float) -> None:
        self.left_s = at_most_s
        self.used_s = 0.0
        self.is_over = False
        """The caller has its response. Tasks that it left behind are no longer limited."""
        self.overdue: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        """Done when a transaction was given up and does not end: whoever waits for the caller can stop waiting."""

    def is_overdue(self) -> None:
        """A transaction did not end although it was given up."""
        if not self.overdue.done():
            self.overdue.set_result(None)

    def failed_after(self, took_s: float) -> None:
        """A transaction failed after this many seconds."""
        self.left_s = max(0.0, self.left_s - took_s)
        self.used_s += took_s


class EndingTasks:
    """Cancelled tasks that may take their time to end. Nobody awaits them."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Future[Any]] = set()

    def let_end(self, task: asyncio.Future[Any]) -> None:
        """Cancels the task."""
        task.cancel()
        self._tasks.add(task)
        task.add_done_callback(self._ended)

    def _ended(self, task: asyncio.Future[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()  # otherwise it is reported as never retrieved


_current: Final[ContextVar[DatabaseWait | None]] = ContextVar("database_wait", default=None)
_give_up_at: Final[ContextVar[float | None]] = ContextVar("database_give_up_at", default=None)


@contextmanager
def waiting_at_most(seconds: float) -> Iterator[DatabaseWait]:
    """Limits the total time of failing transactions in this block, and in the tasks that it starts."""
    outer = current_wait()
    wait = DatabaseWait(seconds if outer is None else min(seconds, outer.left_s))
    token = _current.set(wait)
    try:
        yield wait
    finally:
        wait.is_over = True
        if outer is not None:
            outer.failed_after(wait.used_s)
        _current.reset(token)


def current_wait() -> DatabaseWait | None:
    """None outside of `waiting_at_most`, and in a task that outlives it."""
    wait = _current.get()
    return None if wait is None or wait.is_over else wait


@contextmanager
def giving_up_after(seconds: float) -> Iterator[None]:
    """Sets the deadline of one transaction for parts that do not see it, and for whoever waits for its caller."""
    token = _give_up_at.set(time.perf_counter() + seconds)
    wait, alarm = current_wait(), None
    if wait is not None:
        alarm = asyncio.get_running_loop().call_later(seconds + ENDS_WITHIN_S, wait.is_overdue)
    try:
        yield
    finally:
        if alarm is not None:
            alarm.cancel()
        _give_up_at.reset(token)


def left_s(at_most_s: float) -> float:
    """Returns how long the running transaction may still wait for one response."""
    give_up_at = _give_up_at.get()
    return at_most_s if give_up_at is None else max(0.0, min(at_most_s, give_up_at - time.perf_counter()))
