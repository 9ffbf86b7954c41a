"""When to read the data channel's socket: at once, or in rounds with a rest before each. Sans-I/O.

No datagram waits longer than MAX_REST_S, the deadline of batching on this side. Drones that are flown or in focus have
sockets of their own, which never rest (`server.link.api.connected_sockets`). If the system has no such socket left for
one of them, rests last URGENT_REST_S at most. Frames to drones never wait.

A rest pays when more datagrams are about to arrive. A datagram that arrives alone after silence is read at once, and so
is each one of a single agent that sends every 10 ms: resting would delay them without combining any. When more are
expected, the first one begins a rest, and all that arrive before its end are read together. That takes two wake-ups, so
it pays from three datagrams on. Under heavy load the next rest begins at once and needs no wake-up. Under very heavy
load rests get shorter, which saves kernel memory and delay.
"""

from typing import Final

MAX_REST_S: Final = 0.020
"""Nobody sees it on a map that is drawn ten times a second. A wake-up of the process costs as much as ten datagrams."""

URGENT_REST_S: Final = 0.001
"""Maximum rest while somebody waits for datagrams of this socket."""

CLOSE_WITHIN_S: Final = 0.005
"""Datagrams that arrive this close to each other have several senders: one agent sends every 10 ms at most."""

CLOSE_IN_A_ROW: Final = 2
"""After this many close arrivals, more are expected."""

MIN_REST_S: Final = 0.001

BATCH_GOAL: Final = 32
"""Datagrams to read together. With more of them, one gets no cheaper."""

MAX_UNPROFITABLE: Final = 2
"""Reading two together takes as many wake-ups as reading each on arrival, and makes one of them late."""

MIN_STEADY: Final = 4
"""If one rest brought this many datagrams, the next one almost certainly brings some."""

MAX_SMALL_ROUNDS: Final = 8
"""After this many rounds of at most MAX_UNPROFITABLE datagrams, each datagram is read at once again."""


class ReadPacer:
    """Report arrivals to it. It returns how long to rest, in seconds; None: do not rest."""

    def __init__(self) -> None:
        self.urgent = False
        """Whether somebody waits for datagrams of this socket. Keep it current."""
        self._rounds_left = 0
        self._rest_s = MAX_REST_S
        self._last_alone_at = float("-inf")
        self._close_arrivals = 0
        """Arrivals in a row that followed the previous one within CLOSE_WITHIN_S."""

    @property
    def _max_rest_s(self) -> float:
        return URGENT_REST_S if self.urgent else MAX_REST_S

    def arrived(self, now: float) -> float | None:
        """Something arrived while the socket was watched. Returns the rest before reading it; None: read at once."""
        if self._rounds_left:
            return min(self._rest_s, self._max_rest_s)
        self._close_arrivals = self._close_arrivals + 1 if now - self._last_alone_at < CLOSE_WITHIN_S else 0
        if self._close_arrivals >= CLOSE_IN_A_ROW:
            self._rounds_left, self._close_arrivals = MAX_SMALL_ROUNDS, 0
        self._last_alone_at = now
        return None

    def read_after_rest(self, count: int) -> float | None:
        """`count` datagrams were read after a rest. Returns the next rest; None: watch the socket."""
        if count > 1:
            max_rest_s = self._max_rest_s
            self._rest_s = min(max(self._rest_s * BATCH_GOAL / count, MIN_REST_S), max_rest_s)
            many = count > MAX_UNPROFITABLE or self._rest_s < max_rest_s
            self._rounds_left = MAX_SMALL_ROUNDS if many else self._rounds_left - 1
            return self._rest_s if count >= MIN_STEADY or self._rest_s < max_rest_s else None
        self._rounds_left -= 1
        self._rest_s = MAX_REST_S
        self._last_alone_at = float("-inf")
        return None
