"""When a side changes to its next key, and when it stops opening datagrams sealed with the previous one. No I/O.

Each direction has its own keys, and the sender decides. A side changes its key after a time or a number of datagrams,
but only after something sealed with its present key is known to have arrived: so it is at most one key ahead of the
other side, whatever the network loses.
"""

from typing import Final

REKEY_AFTER_S: Final = 600.0
REKEY_AFTER_DATAGRAMS: Final = 1 << 20
"""Seventeen minutes at a thousand datagrams per second; the cipher's limit is 2**60 and more."""

OUTLIVED_AFTER_S: Final = 2 * REKEY_AFTER_S
"""A key long overdue for a change: nothing sealed with it has arrived. Such a link is not resumed."""

OVERLAP_S: Final = 10.0
"""Datagrams in transit at a key change have arrived by then."""


class Rekeying:
    """The sender's half: one for each side of a link."""

    def __init__(self, now: float) -> None:
        self._since = now
        self._first = 0
        """Counter of the first datagram under the present key."""

    def due(self, *, sealed: int, arrived: int, now: float) -> bool:
        """Returns whether to change to the next key now, and records the change. `sealed`: datagrams so far, under all
        keys; `arrived`: the highest counter that the other side has reported, plus one."""
        if arrived <= self._first:
            return False
        if now - self._since < REKEY_AFTER_S and sealed - self._first < REKEY_AFTER_DATAGRAMS:
            return False
        self._since = now
        self._first = sealed
        return True

    def outlived(self, now: float) -> bool:
        """Returns whether the present key has been in use longer than any key should be."""
        return now - self._since > OUTLIVED_AFTER_S


class Retiring:
    """The receiver's half."""

    def __init__(self) -> None:
        self._phase = 0
        self._at: float | None = None

    def due(self, *, phase: int, now: float) -> bool:
        """Returns whether to discard the previous key now. `phase`: of the newest key under which a datagram
        arrived."""
        if phase != self._phase:
            self._phase = phase
            self._at = now + OVERLAP_S
        if self._at is None or now < self._at:
            return False
        self._at = None
        return True
