"""Round trip and loss of a link, measured by pings that each side sends on its own.

Takes `now` (seconds, monotonic); reads no clock.
"""

from collections import deque
from typing import Final

from wire.content import Ping, Pong

PING_INTERVAL_S: Final = 0.5
"""Two a second: the 2 s after which a silent link counts as lost then spans four of them."""

ANSWER_WITHIN_S: Final = 2.0
"""A ping not answered by then counts as lost."""

PROBE_SEQUENCES: Final = 1 << 31
"""Sequence numbers from here on are those of probes, which are no part of this measurement."""

REMEMBERED: Final = 20
"""Pings over which the loss is told: ten seconds."""


def clock_stamp_us(now: float) -> int:
    """`now` as a ping carries it."""
    return int(now * 1e6) & 0xFFFFFFFFFFFFFFFF


class Keepalive:
    """One side's view of a link. Ask `ping_due`; feed it every pong; read `rtt_s`, `loss`, `silent_for`."""

    def __init__(self, now: float) -> None:
        self._next_ping = now
        self._sequence = 0
        self._waiting: dict[int, float] = {}
        self._answered: deque[bool] = deque(maxlen=REMEMBERED)
        self._last_heard = now
        self._newest_answered = 0
        self.rtt_s: float | None = None
        """Smoothed round trip, or None before the first answer."""

    def ping_due(self, now: float) -> Ping | None:
        """A ping to send now, or None. Never more than one for each PING_INTERVAL_S."""
        if now < self._next_ping:
            return None
        self._next_ping = now + PING_INTERVAL_S
        for sequence, sent in list(self._waiting.items()):
            if now - sent > ANSWER_WITHIN_S:
                del self._waiting[sequence]
                self._answered.append(False)
        self._sequence = (self._sequence + 1) % PROBE_SEQUENCES
        self._waiting[self._sequence] = now
        return Ping(self._sequence, clock_stamp_us(now))

    def hurry(self, now: float) -> None:
        """The way has changed: the other side has to hear of it, so the next ping is due now."""
        self._next_ping = now

    def next_ping_at(self) -> float:
        """When `ping_due` will have something."""
        return self._next_ping

    def heard(self, now: float) -> None:
        """Any authentic datagram came."""
        self._last_heard = now

    def pong(self, pong: Pong, now: float) -> float | None:
        """An answer came: its round trip in seconds. None for one that nobody waits for (late, or repeated)."""
        sent = self._waiting.pop(pong.sequence, None)
        if sent is None:
            return None
        self._answered.append(True)
        self._newest_answered = max(self._newest_answered, pong.sequence)
        sample = max(0.0, now - sent)
        self.rtt_s = sample if self.rtt_s is None else self.rtt_s + (sample - self.rtt_s) / 4
        return sample

    def rtt_now_s(self, now: float) -> float:
        """The round trip, or how long an answer is overdue if that is longer; 0 before anything is known.

        A ping whose successor has been answered was lost, which is not the same as slow.
        """
        open_since = [sent for sequence, sent in self._waiting.items() if sequence > self._newest_answered]
        waiting = now - min(open_since) if open_since else 0.0
        return max(self.rtt_s or 0.0, waiting if waiting > PING_INTERVAL_S else 0.0)

    def silent_for(self, now: float) -> float:
        """Seconds since the other side was last heard."""
        return now - self._last_heard

    @property
    def loss(self) -> float:
        """Share of the last pings that nobody answered, 0..1."""
        return self._answered.count(False) / len(self._answered) if self._answered else 0.0
