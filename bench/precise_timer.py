"""Waits until a moment to within some microseconds: an event loop's own timers have millisecond resolution.

Uses a kernel timerfd: an event loop can wait for it as for any other descriptor, without using the processor meanwhile.
"""

from __future__ import annotations

import asyncio
import ctypes
import os
import time
from typing import Final

_CLOCK_MONOTONIC: Final = 1
_ABSOLUTE: Final = 1
_libc: Final = ctypes.CDLL(None, use_errno=True)


class _TimerSpec(ctypes.Structure):
    """struct itimerspec: interval, then the first expiry; seconds and nanoseconds each."""

    _fields_ = [(name, ctypes.c_long) for name in ("interval_s", "interval_ns", "first_s", "first_ns")]


class PreciseTimer:
    """One waiter at a time. Close it when done."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._fd: int = _libc.timerfd_create(_CLOCK_MONOTONIC, os.O_NONBLOCK | os.O_CLOEXEC)
        if self._fd < 0:
            raise OSError(ctypes.get_errno(), "timerfd_create")
        self._waiting: asyncio.Future[None] | None = None
        self._loop.add_reader(self._fd, self._expired)

    async def until(self, moment_s: float) -> None:
        """Returns at `moment_s` of time.monotonic(); at once if it has passed."""
        if moment_s <= time.monotonic():
            return
        seconds = int(moment_s)
        spec = _TimerSpec(0, 0, seconds, int((moment_s - seconds) * 1e9) or 1)
        if _libc.timerfd_settime(self._fd, _ABSOLUTE, ctypes.byref(spec), None):
            raise OSError(ctypes.get_errno(), "timerfd_settime")
        self._waiting = self._loop.create_future()
        await self._waiting

    def _expired(self) -> None:
        os.read(self._fd, 8)
        if self._waiting is not None and not self._waiting.done():
            self._waiting.set_result(None)

    def close(self) -> None:
        """Releases the descriptor."""
        self._loop.remove_reader(self._fd)
        os.close(self._fd)
