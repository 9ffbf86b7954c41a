"""When the data channel's socket is read: at once, or in rounds with a rest before each. Sans-I/O.

The deadline of batching on this side is MAX_REST_S, and half of it while anybody flies by hand: no datagram waits
longer for being read together with others, whatever is in it (it is sealed, so nobody can know). Downwards nothing
waits.

A rest pays where company is to be expected. A datagram that comes alone after silence is read at once, and so is each
one of a single agent that sends every 10 ms: resting would delay them all and bring no two together. Where company is
expected, the first one to come begins a rest, and all that came until its end are read together: two wake-ups of the
process, so that it pays from three datagrams on, and a pair now and then is no company. Where there is so much
that each rest brings several, the next rest begins at once: nothing has to wake the process to begin it. And where so
much comes that many would wait, rests get shorter: less memory of the kernel, less delay, and nothing more to be saved.
"""

from typing import Final

MAX_REST_S: Final = 0.020
"""For eyes on a map, which is drawn ten times a second. A wake-up of the process costs as much as ten datagrams."""

BY_HAND_REST_S: Final = 0.010
"""While somebody flies by hand: as long as frames wait for company in the agent (wire.batching)."""

COMPANY_WITHIN_S: Final = 0.005
"""Datagrams that come so close to each other are company: a single agent sends every 10 ms at most."""

CLOSE_ENOUGH: Final = 2
"""After so many in a row that came so close to the one before, company is expected."""

MIN_REST_S: Final = 0.001

ENOUGH: Final = 32
"""Datagrams that are to be read together: what one costs does not get less with more of them."""

PAIR: Final = 2
"""To read two together takes as many wake-ups as to read each when it comes, and makes one of them late."""

SEVERAL: Final = 4
"""In one rest: then the next one is as good as certain to bring some."""

PATIENCE: Final = 8
"""Rounds of no more than a pair after which each datagram is read at once again."""


class ReadRhythm:
    """Tell it what came; it says how long to rest, or None: do not."""

    def __init__(self) -> None:
        self.by_hand = False
        """Whether anybody flies by hand: keep it current."""
        self._patience = 0
        self._rest_s = MAX_REST_S
        self._last_alone_at = float("-inf")
        self._close = 0
        """So many in a row came soon after the one before."""

    @property
    def _longest_s(self) -> float:
        return BY_HAND_REST_S if self.by_hand else MAX_REST_S

    def came(self, now: float) -> float | None:
        """Something has come while the socket was watched. How long to rest before reading it; None: do it at once."""
        if self._patience:
            return min(self._rest_s, self._longest_s)
        self._close = self._close + 1 if now - self._last_alone_at < COMPANY_WITHIN_S else 0
        if self._close >= CLOSE_ENOUGH:
            self._patience, self._close = PATIENCE, 0
        self._last_alone_at = now
        return None

    def rested(self, count: int) -> float | None:
        """So many datagrams were read after a rest. How long the next rest is to be; None: watch the socket."""
        if count > 1:
            longest_s = self._longest_s
            self._rest_s = min(max(self._rest_s * ENOUGH / count, MIN_REST_S), longest_s)
            many = count > PAIR or self._rest_s < longest_s
            self._patience = PATIENCE if many else self._patience - 1
            return self._rest_s if count >= SEVERAL or self._rest_s < longest_s else None
        self._patience -= 1
        self._rest_s = MAX_REST_S
        self._last_alone_at = float("-inf")
        return None
