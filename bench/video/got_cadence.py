"""When a viewer sends `got`, as the console's player does (web/src/video/got_cadence.ts). Pure: takes `now`.

While nothing is late it reports occasionally, which is a promise: it reports at once if a picture is late or missing.
The tower limits its data in transit by the frequent reports that follow (server/video/core/pacing.py).
"""

from typing import Final, NamedTuple

EVERY_S: Final = 0.075
"""While not calm: the earliest report after the last one, at a picture ..."""
AT_LAST_S: Final = 0.12
"""... and the latest."""
CALM_EVERY_S: Final = 2.0
CALM_AFTER_S: Final = 0.5
"""Without a late or missing picture."""
LATE_S: Final = 0.04
"""Delay above the minimum."""
OVERDUE_S: Final = 0.05
"""After the time at which the next picture should have arrived."""
BEST_FOR_S: Final = 30.0


class Got(NamedTuple):
    """`calm`: the viewer will report at once if a picture is late or missing. `overdue`: the next one should have
    arrived. `held_s`: time since it was drawn."""

    sequence: int
    calm: bool = False
    overdue: bool = False
    held_s: float = 0.0


class GotCadence:
    """One for each connection. Times in seconds, of one clock; capture times may have another."""

    def __init__(self) -> None:
        self._said_at = float("-inf")
        self._promised = False
        """The last report was calm."""
        self._was_overdue = False
        """The last report was overdue."""
        self._newest: int | None = None
        self._unsaid = False
        self._drawn_at = 0.0
        self._uneasy_at: float | None = None
        self._next = 0
        """The expected sequence number."""
        self._expected_at = float("inf")
        self._best_s = self._best_before_s = float("inf")
        self._best_since = float("-inf")

    def came(self, sequence: int, now: float) -> None:
        """Notes a unit that has arrived and is about to be drawn."""
        if sequence != self._next:
            self._uneasy_at = now
        self._next = (sequence + 1) & 0xFFFFFFFF

    def drawn(self, sequence: int, captured_at: float | None, rate_hz: float, now: float) -> Got | None:
        """Notes that this one and all before it are done. `captured_at`: None if not known."""
        if self._uneasy_at is None or captured_at is None or self._is_late(now - captured_at, now):
            self._uneasy_at = now
        self._newest, self._unsaid, self._drawn_at = sequence, True, now
        self._expected_at = now + 1 / rate_hz + OVERDUE_S
        calm = now - self._uneasy_at >= CALM_AFTER_S
        speaks_up = self._was_overdue or (self._promised and not calm)
        if speaks_up or now - self._said_at >= (CALM_EVERY_S if self._promised else EVERY_S):
            return self._say(now, calm=calm)
        return None

    @property
    def look_at(self) -> float:
        """When `look` may have a report, if nothing is drawn before; by then it may be obsolete, and due later."""
        if self._promised:
            return self._expected_at
        return self._said_at + AT_LAST_S if self._unsaid else float("inf")

    def look(self, now: float) -> Got | None:
        """Returns the report that is due."""
        if self._newest is None or now < self.look_at:
            return None
        if self._promised:
            self._uneasy_at = now
            return self._say(now, overdue=True)
        return self._say(now)

    def _say(self, now: float, *, calm: bool = False, overdue: bool = False) -> Got:
        assert self._newest is not None
        self._said_at, self._unsaid = now, False
        self._promised, self._was_overdue = calm, overdue
        return Got(self._newest, calm, overdue, now - self._drawn_at)

    def _is_late(self, took_s: float, now: float) -> bool:
        if now - self._best_since > BEST_FOR_S:
            self._best_before_s, self._best_s, self._best_since = self._best_s, took_s, now
        elif took_s < self._best_s:
            self._best_s = took_s
        return took_s - min(self._best_s, self._best_before_s) > LATE_S
