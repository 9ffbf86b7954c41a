"""When a side changes to its next key, and when it stops accepting the last one. No I/O.

Each direction has its own keys, and the sender decides. It changes after a time or a number of datagrams, but never
before a datagram under the present key is known to have arrived: so it is at most one key ahead of the receiver,
however much the network loses.
"""

from typing import Final

REKEY_AFTER_S: Final = 600.0
REKEY_AFTER_DATAGRAMS: Final = 1 << 20
"""Seventeen minutes of a thousand datagrams a second; the cipher would bear 2**60 and more."""

OUTLIVED_AFTER_S: Final = 2 * REKEY_AFTER_S
"""A key that should have been changed long ago: nothing under it has arrived since. Such a link is not resumed."""

OVERLAP_S: Final = 10.0
"""What was on its way when the key changed has arrived by then."""


class Rekeying:
    """The sender's half: one for each side of a link."""

    def __init__(self, now: float) -> None:
        self._since = now
        self._first = 0
        """Counter of the first datagram under the present key."""

    def due(self, *, sealed: int, arrived: int, now: float) -> bool:
        """Changes to the next key if it is time, and returns whether it did. `sealed`: datagrams so far, under all
        keys; `arrived`: the highest counter that the other side has reported, plus one."""
        if arrived <= self._first:
            return False
        if now - self._since < REKEY_AFTER_S and sealed - self._first < REKEY_AFTER_DATAGRAMS:
            return False
        self._since = now
        self._first = sealed
        return True

    def outlived(self, now: float) -> bool:
        """Whether the present key is in use for longer than any should be."""
        return now - self._since > OUTLIVED_AFTER_S


class Retiring:
    """The receiver's half."""

    def __init__(self) -> None:
        self._phase = 0
        self._at: float | None = None

    def due(self, *, phase: int, now: float) -> bool:
        """Whether the last key is to be given up now. `phase`: of the newest key under which something came."""
        if phase != self._phase:
            self._phase = phase
            self._at = now + OVERLAP_S
        if self._at is None or now < self._at:
            return False
        self._at = None
        return True
