"""When Python's garbage collector searches for cycles. During a search, no frame moves and no hold is sent.

Reference counts free nearly everything at once; only objects that refer to each other need the search. By default it
starts after a number of *new* objects. The states of a thousand drones, queued for twenty browsers, are tens of
thousands of objects, created and freed five times a second: the whole memory was searched every 4 s, for 0.25 s each
time (`python -m bench scale`). So only the youngest objects are searched as usual, and all others at a suitable time:
seldom, or when memory has grown.

Objects that live as long as a connection are old when it ends, so connections must leave no cycles: they drop their
references at the end (tests/integration/test_nothing_left_behind.py). An exception stored in a variable of a frame that
it passed through is such a cycle too.
"""

import gc
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

YOUNG_OBJECTS: Final = 700
"""New objects that trigger a search of the young: a fifth of a millisecond, with 2,000 of them 0.6."""

NEVER: Final = 1_000_000
"""Such searches that trigger a search of those that survived them. Under attack (`python -m bench anonymous`) one took
7 ms, at worst 17, and fifteen of them found 312 objects: it is left to the full search."""

EVERY_S: Final = 3600.0
"""Interval of full searches while no drone is flown by hand."""

GROWN_BYTES: Final = 64 * 1024 * 1024
"""Or when memory has grown by this much since the last time, which is more than a thousand drones that begin to fly;
then at most every AGAIN_S."""

AGAIN_S: Final = 15.0

AT_LEAST_EVERY_S: Final = 24 * 3600.0
AT_LEAST_BYTES: Final = 256 * 1024 * 1024
"""Even while drones are flown by hand: unfreeable memory must not grow without limit."""


@contextmanager
def unsearched() -> Iterator[None]:
    """For imports, and for what else only makes objects that stay. The searches took a tenth of the tower's start."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def settle_memory() -> None:
    """Call it when all permanent objects exist: they are never searched again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(YOUNG_OBJECTS, NEVER, NEVER)


def resident_bytes() -> int:
    """Resident memory of the process; 0 if the system does not report it."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


class FullSearch:
    """Call `check` every second."""

    def __init__(
        self, now: float, *, collect: Callable[[], object] = gc.collect, memory: Callable[[], int] = resident_bytes
    ) -> None:
        self._collect = collect
        self._memory = memory
        self._last_at = now
        self._least = memory()

    def check(self, now: float, *, flown_by_hand: bool) -> None:
        """Searches if it is time. `flown_by_hand`: a pilot would feel a pause in the sticks."""
        held = self._memory()
        self._least = min(self._least, held)
        since_s, grown = now - self._last_at, held - self._least
        if flown_by_hand:
            due = since_s >= AT_LEAST_EVERY_S or (grown >= AT_LEAST_BYTES and since_s >= AGAIN_S)
        else:
            due = since_s >= EVERY_S or (grown >= GROWN_BYTES and since_s >= AGAIN_S)
        if due:
            self._collect()
            self._last_at = now
            self._least = self._memory()
