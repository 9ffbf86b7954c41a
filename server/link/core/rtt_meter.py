"""The round trip between the tower and one browser, measured by pings in its own channel. No I/O; takes `now`."""

from typing import Final

PING_EVERY_S: Final = 0.5
MAX_OPEN: Final = 20
"""Unanswered pings remembered: ten seconds of silence, after which the number cannot matter any more."""


class RttMeter:
    """Ask `ping_due`; feed it pongs; read `rtt_s`, which grows while an answer is missing."""

    def __init__(self) -> None:
        self._sequence = 0
        self._next_at = 0.0
        self._open: dict[int, float] = {}
        self._last_s: float | None = None
        self._answered_at = float("-inf")

    def ping_due(self, now: float) -> int | None:
        """The sequence of a ping to send now, or None."""
        if now < self._next_at:
            return None
        self._next_at = now + PING_EVERY_S
        self._sequence += 1
        if len(self._open) >= MAX_OPEN:
            del self._open[min(self._open)]
        self._open[self._sequence] = now
        return self._sequence

    def pong(self, sequence: int, now: float) -> None:
        """An answer came. Older ones that are still open will not be waited for."""
        sent = self._open.pop(sequence, None)
        if sent is None:
            return
        self._last_s = now - sent
        self._answered_at = max(self._answered_at, sent)
        for older in [one for one in self._open if one < sequence]:
            del self._open[older]

    def late_at_most_s(self, now: float) -> float:
        """How late a message that comes now can be: it was sent after the last answer, and that after its ping."""
        return now - self._answered_at

    def rtt_s(self, now: float) -> float:
        """The last round trip, or how long the oldest answer has been missing, whichever is longer; 0 if unknown."""
        waiting = now - min(self._open.values()) if self._open else 0.0
        return max(self._last_s or 0.0, waiting if waiting > PING_EVERY_S else 0.0)


class TooLong:
    """Whether something has been above a limit for longer than it may. True once each time."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._is_reported = False

    def check(self, value: float, *, limit: float, for_s: float, now: float) -> bool:
        """Call it regularly. `limit` has the unit of `value`."""
        if value <= limit:
            self._since = None
            self._is_reported = False
            return False
        if self._since is None:
            self._since = now
        if self._is_reported or now - self._since < for_s:
            return False
        self._is_reported = True
        return True
