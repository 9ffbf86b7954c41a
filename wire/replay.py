"""The anti-replay window: accepts each counter once, and none older than the window.

The rule of RFC 6479 and WireGuard, with one Python integer as the bitmap.
"""

from typing import Final

WINDOW: Final = 1024
"""Counters behind the newest that may still arrive late: seconds of traffic, more than any reordering."""

_MASK: Final = (1 << WINDOW) - 1


class ReplayWindow:
    """Which counters have been seen. Call `accept` only for authenticated datagrams."""

    __slots__ = ("_seen", "accepted", "newest")

    def __init__(self) -> None:
        self.newest = -1
        """The highest counter accepted, or -1."""
        self._seen = 0
        self.accepted = 0
        """How many counters were accepted: with `newest` this gives the number missing."""

    def accept(self, counter: int) -> bool:
        """True the first time for a counter inside the window; False for a repeat or one that is too old."""
        ahead = counter - self.newest
        if ahead > 0:
            self._seen = ((self._seen << ahead) & _MASK | 1) if ahead < WINDOW else 1
            self.newest = counter
            self.accepted += 1
            return True
        behind = -ahead
        if behind >= WINDOW or self._seen >> behind & 1:
            return False
        self._seen |= 1 << behind
        self.accepted += 1
        return True
