"""Sees when the tower's event loop stands still, and which code held it. Every frame waits this long.

A thread asks the loop to answer twenty times a second. Where no answer comes within HELD_S, it notes what the loop is
running: a route, a report of an agent, a tick. It logs that with the stack, counts it, and remembers it for the alert.
"""

from __future__ import annotations

import asyncio
import re
import sys
import threading
import time
from collections import defaultdict, deque
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Final, NamedTuple

import structlog

ASK_EVERY_S: Final = 0.05
HELD_S: Final = 0.05
REMEMBERED_S: Final = 60.0
LOG_EVERY_S: Final = 10.0
"""A line for each place, at most so often."""
STACK_LINES: Final = 8
NOT_OURS: Final = "elsewhere"
"""No code of ours used the time: the machine gave the process none, or a disk did not answer."""
_ROOT: Final = Path(__file__).resolve().parents[2]
_OURS: Final = ("server", "wire")
_ROUTE: Final = re.compile(r"server\.\w+\.api\.(\w*routes\.)?\w+$")
_log = structlog.get_logger(__name__)


class Hold(NamedTuple):
    """`at`: of the monotonic clock. `where`: `module.function`."""

    at: float
    held_s: float
    where: str


class LoopWatch:
    def __init__(self) -> None:
        self.held_s: defaultdict[str, float] = defaultdict(float)
        """By place, since the start."""
        self._late: deque[Hold] = deque(maxlen=round(REMEMBERED_S / ASK_EVERY_S))
        """Every answer of the last minute; `where` is empty unless it was late."""
        self._logged_at: dict[str, float] = {}
        self._stopping = threading.Event()

    async def watch(self) -> None:
        """Runs until cancelled."""
        loop, thread_id = asyncio.get_running_loop(), threading.get_ident()
        thread = threading.Thread(target=self._ask, args=(loop, thread_id), name="loop-watch", daemon=True)
        thread.start()
        try:
            await loop.create_future()
        finally:
            self._stopping.set()

    @property
    def now_ms(self) -> float:
        return round(self._late[-1].held_s * 1000, 2) if self._late else 0.0

    @property
    def worst_ms(self) -> float:
        """Of the last minute."""
        return round(max((one.held_s for one in self._recent()), default=0.0) * 1000, 2)

    def worst_hold(self) -> Hold | None:
        """Of the last minute, by code of ours."""
        ours = [one for one in self._recent() if one.where not in ("", NOT_OURS)]
        return max(ours, key=lambda one: one.held_s, default=None)

    def _recent(self) -> list[Hold]:
        since = time.monotonic() - REMEMBERED_S
        return [one for one in tuple(self._late) if one.at >= since]

    def _ask(self, loop: asyncio.AbstractEventLoop, thread_id: int) -> None:
        answered = threading.Event()
        clock = time.pthread_getcpuclockid(thread_id)
        while not self._stopping.wait(ASK_EVERY_S):
            asked_at, worked_s = time.monotonic(), time.clock_gettime(clock)
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(answered.set)
            stack: list[str] = []
            where = ""
            if not answered.wait(HELD_S):
                while True:
                    # On a busy machine the work may not have begun when the loop is looked at first.
                    if where in ("", NOT_OURS):
                        stack = list(_ours(sys._current_frames().get(thread_id)))
                        where = _place(stack)
                    if answered.wait(ASK_EVERY_S):
                        break
                    if self._stopping.is_set():
                        return
            answered.clear()
            now = time.monotonic()
            if where and time.clock_gettime(clock) - worked_s < HELD_S:
                where = NOT_OURS
            self._note(Hold(now, now - asked_at, where), stack)

    def _note(self, hold: Hold, stack: list[str]) -> None:
        self._late.append(hold)
        if not hold.where:
            return
        self.held_s[hold.where] += hold.held_s
        if hold.at - self._logged_at.get(hold.where, float("-inf")) >= LOG_EVERY_S:
            self._logged_at[hold.where] = hold.at
            through = " > ".join(stack[-STACK_LINES:])
            log = _log.info if hold.where == NOT_OURS else _log.warning
            log("loop_held", where=hold.where, held_ms=round(hold.held_s * 1000), through=through)


def _ours(frame: FrameType | None) -> Iterator[str]:
    """The functions of this product on a stack, outermost first."""
    found = []
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        if path.is_relative_to(_ROOT) and path.relative_to(_ROOT).parts[0] in _OURS:
            module = ".".join(path.relative_to(_ROOT).with_suffix("").parts)
            found.append(f"{module}.{frame.f_code.co_name}")
        frame = frame.f_back
    return reversed(found)


def _place(stack: list[str]) -> str:
    """A route, where one is running; else the innermost function of ours that is not only a way to others."""
    for one in stack:
        if _ROUTE.match(one):
            return one
    inner = [one for one in stack if not one.endswith((".run", ".until_stopped", ".main", ".__call__"))]
    return inner[-1] if inner else NOT_OURS
