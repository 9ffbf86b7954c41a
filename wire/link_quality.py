"""Round trip, jitter and loss of a link over the last seconds. No I/O; takes `now`.

Fed by the keep-alives: each tells how many datagrams its sender has received so far (wire.content.Report), so either
side knows the loss of both directions, and a keep-alive that is lost itself takes no knowledge with it.
"""

from collections import deque
from itertools import pairwise
from typing import Final, NamedTuple

from wire.content import Report

SHORT_WINDOW_S: Final = 1.0
LONG_WINDOW_S: Final = 30.0

_REMEMBERED: Final = 256
"""Points kept of each kind: those of 30 s at twice the usual rate."""


class Quality(NamedTuple):
    """Over one window, seen from one side. None is: not known."""

    rtt_s: float | None = None
    """Mean of the round trips."""
    jitter_s: float | None = None
    """Mean difference between one round trip and the next."""
    loss_sent: float | None = None
    """Share of what this side sent that did not arrive, 0..1."""
    loss_received: float | None = None
    """Share of what the other side sent that did not arrive here, 0..1."""


class _Counted:
    """How two counters, that only grow, grew over a window."""

    def __init__(self, now: float) -> None:
        self._points: deque[tuple[float, Report]] = deque([(now, Report())], maxlen=_REMEMBERED)

    def note(self, report: Report, now: float) -> None:
        # One that was overtaken on its way has nothing new to say.
        points = self._points
        if report.expected >= points[-1][1].expected:
            points.append((now, report))
        # The newest of those before the window is where the window begins; what is older says nothing any more.
        while len(points) > 1 and now - points[1][0] >= LONG_WINDOW_S:
            points.popleft()

    def loss(self, window_s: float, now: float) -> float | None:
        """None if nothing is known of the window; 1.0 if it is known that nothing came."""
        told_at, last = self._points[-1]
        if last.expected == 0 or now - told_at > window_s:
            return None
        begin = self._points[0][1]
        for at, report in self._points:
            if at > now - window_s:
                break
            begin = report
        expected = last.expected - begin.expected
        if expected <= 0:
            # Two pings a second are sent at least: nothing for a whole second means that they were lost.
            return 1.0 if now - self._points[0][0] > window_s >= SHORT_WINDOW_S else None
        return min(1.0, max(0.0, 1.0 - (last.received - begin.received) / expected))


class LinkQuality:
    """Feed it each round trip, each report that came, and one's own counters; ask `over`."""

    def __init__(self, now: float) -> None:
        self._trips: deque[tuple[float, float]] = deque(maxlen=_REMEMBERED)
        self._sent = _Counted(now)
        self._received = _Counted(now)

    def round_trip(self, rtt_s: float, now: float) -> None:
        """A ping was answered."""
        self._trips.append((now, rtt_s))
        while now - self._trips[0][0] > LONG_WINDOW_S:
            self._trips.popleft()

    def told(self, report: Report, now: float) -> None:
        """The other side says what it has received."""
        self._sent.note(report, now)

    def counted(self, report: Report, now: float) -> None:
        """What this side has received: note it at least as often as a ping is sent."""
        self._received.note(report, now)

    def over(self, window_s: float, now: float) -> Quality:
        """`window_s`: SHORT_WINDOW_S or LONG_WINDOW_S, or between."""
        trips = [rtt for at, rtt in self._trips if now - at <= window_s]
        steps = [abs(later - earlier) for earlier, later in pairwise(trips)]
        return Quality(
            rtt_s=sum(trips) / len(trips) if trips else None,
            jitter_s=sum(steps) / len(steps) if steps else None,
            loss_sent=self._sent.loss(window_s, now),
            loss_received=self._received.loss(window_s, now),
        )
