"""When to read the data channel's socket: at once, or in rounds with a rest before each. Sans-I/O.

No datagram waits longer than MAX_REST_S, the deadline of batching on this side. Drones that are flown or in focus have
sockets of their own, which never rest (`server.api.relay.connected_sockets`); where the system has none for one of
them, rests last HURRIED_REST_S at most. Downwards nothing waits.

A rest pays when more datagrams are about to arrive. A datagram that arrives alone after silence is read at once, and so
is each one of a single agent that sends every 10 ms: resting would delay them without combining any. When more are
expected, the first one begins a rest, and all that arrive before its end are read together. That takes two wake-ups, so
it pays from three datagrams on. Under heavy load the next rest begins at once and needs no wake-up. Under very heavy
load rests get shorter, which saves kernel memory and delay.
"""

from typing import Final

MAX_REST_S: Final = 0.020
"""For eyes on a map, which is drawn ten times a second. A wake-up of the process costs as much as ten datagrams."""

HURRIED_REST_S: Final = 0.001
"""Longest rest while somebody waits for datagrams of this socket."""

COMPANY_WITHIN_S: Final = 0.005
"""Datagrams that come so close to each other are company: a single agent sends every 10 ms at most."""

CLOSE_ENOUGH: Final = 2
"""After this many close arrivals in a row, more are expected."""

MIN_REST_S: Final = 0.001

ENOUGH: Final = 32
"""Datagrams that are to be read together: what one costs does not get less with more of them."""

PAIR: Final = 2
"""To read two together takes as many wake-ups as to read each when it comes, and makes one of them late."""

SEVERAL: Final = 4
"""In one rest: then the next one is as good as certain to bring some."""

PATIENCE: Final = 8
"""Rounds of no more than a pair after which each datagram is read at once again."""


class ReadPacer:
    """Takes what arrived and returns how long to rest; None: do not rest."""

    def __init__(self) -> None:
        self.hurries = False
        """Whether somebody waits for datagrams of this socket. Keep it current."""
        self._patience = 0
        self._rest_s = MAX_REST_S
        self._last_alone_at = float("-inf")
        self._close = 0
        """So many in a row came soon after the one before."""

    @property
    def _longest_s(self) -> float:
        return HURRIED_REST_S if self.hurries else MAX_REST_S

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
