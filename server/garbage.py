"""When Python's garbage collector looks for cycles. While it does, no frame moves and no hold goes out.

Reference counts free nearly everything at once; only objects that point at each other need the search. Left to itself
it begins after so many *new* objects, and the pictures of a thousand drones that wait for twenty browsers are tens of
thousands, made and gone five times a second: the whole memory was walked through every 4 s, for 0.25 s each time
(`python -m bench scale`). So young objects are looked at when there are far more of them, and the old ones at a moment
that suits.
"""

import gc
from collections.abc import Callable
from typing import Final

YOUNG_OBJECTS: Final = 20_000
"""New objects after which they are looked through, some 10 ms."""

NEVER: Final = 1_000_000
"""Rounds of the young ones before Python would look through older ones by itself."""

EVERY_S: Final = 3600.0
"""How often the old ones are looked through while nobody flies by hand."""

AT_LEAST_EVERY_S: Final = 24 * 3600.0
"""And whoever flies: what nobody could free must not grow without end."""


def settle_memory() -> None:
    """Call it when all that stands for ever is made: that is never walked through again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(YOUNG_OBJECTS, NEVER, NEVER)


class FullSearch:
    """Ask it every second."""

    def __init__(self, now: float, collect: Callable[[], object] = gc.collect) -> None:
        self._collect = collect
        self._last_at = now

    def look(self, now: float, *, flown_by_hand: bool) -> None:
        """Searches if it is time. `flown_by_hand`: a pause would be felt in somebody's sticks."""
        if now - self._last_at >= (AT_LEAST_EVERY_S if flown_by_hand else EVERY_S):
            self._collect()
            self._last_at = now
