"""One thread for work of requests that takes longer than a frame may wait. People take turns at it.

The event loop passes sticks on meanwhile: the interpreter changes between the two every millisecond.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, Final, TypeVar

from server.kernel.fair_queue import FairQueue
from server.kernel.refusal import RetryLater
from server.kernel.shares import ShareName, Shares

MAX_WAITING: Final = 64
RETRY_AFTER_S: Final = 2.0
TOWERS_OWN: Final = 0
"""Instead of a person: work that nobody asked for, and that is never refused."""

_Answer = TypeVar("_Answer")
_Done = tuple[Any, Exception | None, float]
"""The answer or the error, and the processor time in seconds."""


class TooMuchWork(RetryLater):
    """This person, or all together, already wait for as much as may wait."""

    def __init__(self, *, yours: bool) -> None:
        words = "you already wait for as much work of the tower as one person may" if yours else "the tower is busy"
        super().__init__(f"{words}: try again in a moment", retry_after_s=RETRY_AFTER_S)


class SideThread:
    """`name`: of the thread, for whoever looks at the process. `on_spent` is told who used how much processor time,
    seconds, when a piece of work is done."""

    def __init__(
        self, name: str, shares: Shares | None = None, *, on_spent: Callable[[int, float], None] | None = None
    ) -> None:
        self._shares = shares or Shares()
        self._on_spent = on_spent
        self._thread = ThreadPoolExecutor(1, thread_name_prefix=name)
        self._waiting: FairQueue[int, tuple[Callable[[], Any], asyncio.Future[Any]]] = FairQueue(share=MAX_WAITING)
        """By person."""
        self._is_working = False

    async def in_turn(self, user_id: int, work: Callable[[], _Answer]) -> _Answer:
        """The answer of `work`, or what it raises. Raises TooMuchWork. Who no longer waits for it loses the turn,
        unless the work has begun."""
        if user_id != TOWERS_OWN:
            if self._waiting.waiting(user_id) >= self._shares.limit(ShareName.WORK):
                raise TooMuchWork(yours=True)
            if len(self._waiting) >= MAX_WAITING:
                raise TooMuchWork(yours=False)
        answer: asyncio.Future[_Answer] = asyncio.get_running_loop().create_future()
        self._waiting.put(user_id, (work, answer))
        self._next()
        return await answer

    def waiting(self) -> dict[int, int]:
        """How much waits of each person."""
        return self._waiting.all_waiting()

    def _next(self) -> None:
        while not self._is_working and self._waiting:
            user_id, (work, answer) = self._waiting.pop()
            if answer.cancelled():
                continue
            self._is_working = True
            done = asyncio.get_running_loop().run_in_executor(self._thread, _clocked, work)
            done.add_done_callback(partial(self._worked, user_id, answer))

    def _worked(self, user_id: int, answer: asyncio.Future[Any], done: asyncio.Future[_Done]) -> None:
        self._is_working = False
        if done.cancelled():  # closed
            answer.cancel()
            return
        result, error, seconds = done.result()
        if self._on_spent is not None and user_id != TOWERS_OWN:
            self._on_spent(user_id, seconds)
        if not answer.done():
            if error is None:
                answer.set_result(result)
            else:
                answer.set_exception(error)
        self._next()

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)


def _clocked(work: Callable[[], Any]) -> _Done:
    began = time.thread_time()
    try:
        return work(), None, time.thread_time() - began
    except Exception as error:
        return None, error, time.thread_time() - began
