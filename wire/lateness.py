"""Measures how late messages arrive, by stamps of the sender's own clock. No I/O; takes `now`.

The two clocks need not agree: the least difference between arrival and stamp over the last seconds counts as "not late"
(the shortest path through the network), and anything beyond it is delay. A queue on the path, a stalled TCP connection
and a replayed backlog all show; the plain length of the path does not (the keep-alive measures that).
"""

from collections import deque
from math import inf
from typing import Final

WINDOW_S: Final = 30.0
"""Long enough to include an uncongested moment; short enough that clock drift (some 50 ppm) stays within 3 ms."""

FORGET_S: Final = 600.0
"""After a silence of this length the clocks may have drifted too far (60 ms) for the old reference to be valid."""

BUCKET_S: Final = 1.0
CLOCK_MS: Final = 1 << 32
"""Stamps are milliseconds modulo this: 49 days."""


def stamp_ms(now: float) -> int:
    """Converts `now` (seconds) to a stamp."""
    return int(now * 1000.0) % CLOCK_MS


class Lateness:
    """Feed it every stamp of one sender; it returns how late each was."""

    def __init__(self) -> None:
        self._first: tuple[int, float] | None = None
        self._least: deque[tuple[float, float]] = deque()
        """(beginning of the bucket, least offset in it), oldest first."""

    def late_by(self, stamp: int, now: float, *, at_most_s: float = inf) -> float:
        """Returns the seconds by which this stamp is late, 0 or more. The first stamp of a sender is never late.

        `at_most_s`: an upper bound known from elsewhere. A stamp that is later than that comes from a clock that stood
        still (a computer that slept); the measurement then restarts from the bound.
        """
        if self._first is None:
            self._first = (stamp, now)
        first_stamp, first_now = self._first
        # Signed difference modulo 2**32, so that the sender's clock may wrap.
        sent_s = ((stamp - first_stamp + CLOCK_MS // 2) % CLOCK_MS - CLOCK_MS // 2) / 1000.0
        offset = (now - first_now) - sent_s
        if abs(sent_s) > CLOCK_MS / 4000.0:
            # Twelve days later: begin again long before the difference could wrap.
            self._first = (stamp, now)
            self._least.clear()
            self._least.append((now, 0.0))
            return 0.0
        buckets = self._least
        # Keeps the last bucket before the window: a sender that was silent for long is measured against it. Else the
        # first command after a pause would count as on time, however late.
        while len(buckets) > 1 and now - buckets[1][0] > WINDOW_S:
            buckets.popleft()
        if buckets and now - buckets[-1][0] > FORGET_S:
            buckets.clear()
        if buckets and now - buckets[-1][0] < BUCKET_S:
            start, least = buckets[-1]
            buckets[-1] = (start, min(least, offset))
        else:
            buckets.append((now, offset))
        late_s = max(0.0, offset - min(least for _, least in buckets))
        if late_s <= at_most_s:
            return late_s
        for at, (start, least) in enumerate(buckets):
            buckets[at] = (start, max(least, offset - at_most_s))
        return at_most_s
