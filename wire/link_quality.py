"""Round trip, jitter and loss of a link over the last seconds. No I/O; takes `now`.

Fed by the keep-alives: each reports how many datagrams its sender has received so far (wire.content.Report), so either
side knows the loss of both directions, and the loss of a keep-alive itself loses no information.
"""

from collections import deque
from typing import Final, NamedTuple

from wire.content import Report

SHORT_WINDOW_S: Final = 1.0
LONG_WINDOW_S: Final = 30.0

_REMEMBERED: Final = 256
"""Points kept of each kind: 30 s at twice the usual rate."""


class Quality(NamedTuple):
    """Over one window, seen from one side. None: not known."""

    rtt_s: float | None = None
    """Mean of the round trips."""
    jitter_s: float | None = None
    """Mean difference between one round trip and the next."""
    loss_sent: float | None = None
    """Share of what this side sent that did not arrive, 0..1."""
    loss_received: float | None = None
    """Share of what the other side sent that did not arrive here, 0..1."""


class _Counted:
    """How two monotonic counters grew over a window."""

    def __init__(self, now: float) -> None:
        self._points: deque[tuple[float, Report]] = deque([(now, Report())], maxlen=_REMEMBERED)

    def note(self, report: Report, now: float) -> None:
        # A report that arrived out of order has nothing new.
        points = self._points
        if report.expected >= points[-1][1].expected:
            points.append((now, report))
        # The newest point before the window is its beginning; older points are no longer needed.
        while len(points) > 1 and now - points[1][0] >= LONG_WINDOW_S:
            points.popleft()

    def loss(self, window_s: float, now: float) -> float | None:
        """None if nothing is known of the window; 1.0 if it is known that nothing arrived."""
        reported_at, last = self._points[-1]
        if last.expected == 0 or now - reported_at > window_s:
            return None
        begin = self._before(now - window_s, near_the_end=window_s < LONG_WINDOW_S / 2)
        expected = last.expected - begin.expected
        if expected <= 0:
            # A window contains at least two pings: if nothing arrived in all of it, they were lost.
            return 1.0 if now - self._points[0][0] > window_s >= SHORT_WINDOW_S else None
        return min(1.0, max(0.0, 1.0 - (last.received - begin.received) / expected))

    def _before(self, moment: float, *, near_the_end: bool) -> Report:
        """Returns the newest report that is not later than `moment`, or else the oldest of all. Searches from the
        nearer end: this runs every second for a thousand links."""
        begin = self._points[0][1]
        if near_the_end:
            for at, report in reversed(self._points):
                if at <= moment:
                    return report
            return begin
        for at, report in self._points:
            if at > moment:
                break
            begin = report
        return begin


class LinkQuality:
    """Feed it each round trip, each received report and this side's own counters; call `over`."""

    def __init__(self, now: float) -> None:
        self._trips: deque[tuple[float, float]] = deque()
        self._trip_sum_s = 0.0
        """Sum of `_trips`."""
        self._step_sum_s = 0.0
        """Sum of the differences between consecutive trips."""
        self._sent = _Counted(now)
        self._received = _Counted(now)

    def round_trip(self, rtt_s: float, now: float) -> None:
        """Notes the round trip of an answered ping."""
        trips = self._trips
        if len(trips) == _REMEMBERED:
            self._forget_oldest()
        if trips:
            self._step_sum_s += abs(rtt_s - trips[-1][1])
        self._trip_sum_s += rtt_s
        trips.append((now, rtt_s))
        self._forget_old(now)

    def _forget_old(self, now: float) -> None:
        while self._trips and now - self._trips[0][0] > LONG_WINDOW_S:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        trips = self._trips
        _, rtt_s = trips.popleft()
        if trips:
            self._trip_sum_s -= rtt_s
            self._step_sum_s -= abs(trips[0][1] - rtt_s)
        else:  # and rounding errors do not accumulate
            self._trip_sum_s = self._step_sum_s = 0.0

    def receive_report(self, report: Report, now: float) -> None:
        """Notes what the other side reports to have received."""
        self._sent.note(report, now)

    def counted(self, report: Report, now: float) -> None:
        """Notes what this side has received; call it at least as often as a ping is sent."""
        self._received.note(report, now)

    def over(self, window_s: float, now: float) -> Quality:
        """`window_s`: SHORT_WINDOW_S to LONG_WINDOW_S. A window shorter than two ping intervals would often have no
        value."""
        rtt_s, jitter_s = self._trips_over(window_s, now)
        return Quality(rtt_s, jitter_s, self._sent.loss(window_s, now), self._received.loss(window_s, now))

    def _trips_over(self, window_s: float, now: float) -> tuple[float | None, float | None]:
        if window_s >= LONG_WINDOW_S:
            self._forget_old(now)
            count, trip_sum_s, step_sum_s = len(self._trips), self._trip_sum_s, self._step_sum_s
        else:
            count, trip_sum_s, step_sum_s, later_s = 0, 0.0, 0.0, None
            for at, rtt_s in reversed(self._trips):
                if now - at > window_s:
                    break
                count += 1
                trip_sum_s += rtt_s
                if later_s is not None:
                    step_sum_s += abs(later_s - rtt_s)
                later_s = rtt_s
        return (
            trip_sum_s / count if count else None,
            max(0.0, step_sum_s) / (count - 1) if count > 1 else None,
        )
