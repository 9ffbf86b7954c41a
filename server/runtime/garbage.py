"""When Python's garbage collector searches for cycles. During a search no frame moves and no hold goes out.

Reference counts free nearly everything at once; only objects that refer to each other need the search. By default it
begins after a number of *new* objects. The state of a thousand drones that waits for twenty browsers is tens of
thousands of them, created and freed five times a second: the whole memory was searched every 4 s, for 0.25 s each time
(`python -m bench scale`). So young objects are searched as usual, and old ones at a suitable moment: seldom, or when
memory has grown.

Objects that live as long as a connection are old when it ends, so connections must leave no cycles: their ends undo
mutual references (tests/integration/test_nothing_left_behind.py). An exception kept in a variable of a frame that it
passed through is such a cycle too.
"""

import gc
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

YOUNG_OBJECTS: Final = 2_000
"""New objects after which they are looked through: less than a millisecond."""

YOUNG_ROUNDS: Final = 5
"""Rounds of those after which what has survived since the last time is looked through too: some milliseconds."""

NEVER: Final = 1_000_000
"""Rounds before Python would search everything by itself."""

EVERY_S: Final = 3600.0
"""Interval of full searches while nobody flies by hand."""

GROWN_BYTES: Final = 64 * 1024 * 1024
"""Or when memory has grown by this much since the last search, more than a thousand drones that begin to fly; then at
most every AGAIN_S."""

AGAIN_S: Final = 15.0

AT_LEAST_EVERY_S: Final = 24 * 3600.0
AT_LEAST_BYTES: Final = 256 * 1024 * 1024
"""Even during flight by hand: garbage must not grow without bound."""


def settle_memory() -> None:
    """Call it when all permanent objects exist: they are never searched again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(YOUNG_OBJECTS, YOUNG_ROUNDS, NEVER)


def resident_bytes() -> int:
    """What the process has in memory now; 0 where the system does not tell."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


class FullSearch:
    """Ask it every second."""

    def __init__(
        self, now: float, *, collect: Callable[[], object] = gc.collect, memory: Callable[[], int] = resident_bytes
    ) -> None:
        self._collect = collect
        self._memory = memory
        self._last_at = now
        self._least = memory()

    def check(self, now: float, *, flown_by_hand: bool) -> None:
        """Searches if it is time. `flown_by_hand`: a pilot would feel the pause."""
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
