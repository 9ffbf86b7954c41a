"""Round trip and loss of a link. The agent leads: it sends pings on its own and reports its measurements in each ping.

So the tower knows as much without pings and clocks of its own: with a thousand links they would be most of its work. It
sends pings only while somebody flies (`watch_closely`): then it must itself notice missing answers at once.

The leading side may slow down when nothing depends on it (`at_leisure`): after an answered ping the next one may come
later. After an unanswered ping, or while the other side sends pings too, the usual interval applies.

Takes `now` (seconds, monotonic); reads no clock.
"""

from collections import deque
from typing import Final

from wire.content import LOST_OF, Ping, Pong

PING_INTERVAL_S: Final = 0.5
"""Two per second: the 2 s after which a silent link counts as lost span four pings."""

LEISURE_S: Final = 1.0
"""The interval at leisure, if the last ping was answered."""

CLOSE_S: Final = 2.0
"""After a ping of the other side, the leading side keeps the usual interval for this long."""

ANSWER_WITHIN_S: Final = 2.0
"""A ping without an answer by then counts as lost."""

PROBE_SEQUENCES: Final = 1 << 31
"""Sequence numbers from here on belong to probes, which are not part of this measurement."""

REMEMBERED: Final = 20
"""The number of pings over which the loss is computed: ten seconds, or twenty at leisure."""

_MAX_REPORTED_US: Final = (1 << 32) - 1
_NEVER: Final = float("inf")


class Keepalive:
    """One side's view of a link. Call `ping_due`; pass it pongs and the other side's pings; read `rtt_s`, `loss`."""

    def __init__(self, now: float, *, leads: bool = True) -> None:
        self._leads = leads
        self._pings = leads
        """Whether this side sends pings at present."""
        self.next_ping_at = now if leads else _NEVER
        """When `ping_due` will have something."""
        self._sequence = 0
        self._waiting: dict[int, float] = {}
        self._answered: deque[bool] = deque(maxlen=REMEMBERED)
        self._newest_answered = 0
        self._newest_heard = 0
        self._pinged_at = now
        self._leisure = False
        self._close_until = now
        self._rests_s = 0.0
        self._reported_loss = 0.0
        self._unreported_us = 0
        self.heard_at = now
        """When the other side last sent an authentic datagram; the caller sets it."""
        self.rtt_s: float | None = None
        """Smoothed round trip, or None before the first answer."""

    def watch_closely(self, closely: bool, now: float) -> None:
        """Sets whether the side that does not lead measures by itself. No effect on the leading side."""
        if self._leads or closely == self._pings:
            return
        self._pings = closely
        self.next_ping_at = now if closely else _NEVER
        self._waiting.clear()
        self._answered.clear()

    def at_leisure(self, leisure: bool) -> None:
        """Sets whether the leading side may slow down. No effect on the other side."""
        if self._leads:
            self._leisure = leisure
            if not leisure:
                self._no_later_than_usual()

    @property
    def rests_s(self) -> float:
        """The extra silence beyond the usual interval that is normal at present. Callers that judge by silence or by
        missing proof subtract it."""
        if self._leads:
            return self._rests_s
        return 0.0 if self._pings else LEISURE_S - PING_INTERVAL_S

    def _no_later_than_usual(self) -> None:
        self.next_ping_at = min(self.next_ping_at, self._pinged_at + PING_INTERVAL_S)

    def ping_due(self, now: float) -> Ping | None:
        """Returns a ping to send now, or None. At most one per PING_INTERVAL_S, apart from those sent along with
        frames."""
        return None if now < self.next_ping_at else self.ping(now)

    def ping(self, now: float) -> Ping:
        """Returns a ping to send now, due or not: the next one is due an interval later."""
        self._pinged_at = now
        self.next_ping_at = now + PING_INTERVAL_S
        for sequence, sent in list(self._waiting.items()):
            if now - sent > ANSWER_WITHIN_S:
                del self._waiting[sequence]
                self._answered.append(False)
        self._sequence = (self._sequence + 1) % PROBE_SEQUENCES
        self._waiting[self._sequence] = now
        trip_us, self._unreported_us = self._unreported_us, 0
        return Ping(self._sequence, trip_us=trip_us, lost=round(self.loss * LOST_OF))

    def hurry(self, now: float) -> None:
        """Makes the next ping due now: the path has changed, and the other side must learn it."""
        if self._pings:
            self.next_ping_at = now

    def pong(self, pong: Pong, now: float) -> float | None:
        """Takes an answer; returns its round trip in seconds. None for an answer that is late or repeated."""
        sent = self._waiting.pop(pong.sequence, None)
        if sent is None:
            return None
        self._answered.append(True)
        self._newest_answered = max(self._newest_answered, pong.sequence)
        if self._leads and pong.sequence == self._sequence:
            leisure = self._leisure and now >= self._close_until
            self._rests_s = LEISURE_S - PING_INTERVAL_S if leisure else 0.0
            if self.next_ping_at == sent + PING_INTERVAL_S:  # else `hurry` has moved it
                self.next_ping_at += self._rests_s
        sample = max(0.0, now - sent)
        self._unreported_us = min(max(round(sample * 1e6), 1), _MAX_REPORTED_US)
        self._smooth(sample)
        return sample

    def receive_ping(self, ping: Ping, now: float) -> float | None:
        """Takes the other side's ping; returns its reported round trip in seconds. None if this side measures by
        itself."""
        if self._leads:
            self._close_until = now + CLOSE_S
            self._no_later_than_usual()
        if self._pings or ping.sequence <= self._newest_heard:
            return None
        self._newest_heard = ping.sequence
        self._reported_loss = ping.lost / LOST_OF
        if not ping.trip_us:
            return None
        sample = ping.trip_us / 1e6
        self._smooth(sample)
        return sample

    def _smooth(self, sample: float) -> None:
        self.rtt_s = sample if self.rtt_s is None else self.rtt_s + (sample - self.rtt_s) / 4

    def rtt_now_s(self, now: float) -> float:
        """Returns the round trip, or the age of an overdue answer if that is longer; 0 before anything is known.

        A ping whose successor has been answered is lost, not slow.
        """
        open_since = [sent for sequence, sent in self._waiting.items() if sequence > self._newest_answered]
        waiting = now - min(open_since) if open_since else 0.0
        return max(self.rtt_s or 0.0, waiting if waiting > PING_INTERVAL_S else 0.0)

    def silent_for(self, now: float) -> float:
        """Returns the seconds since the other side was last heard."""
        return now - self.heard_at

    @property
    def loss(self) -> float:
        """Unanswered share of the last pings, 0..1."""
        if self._answered:
            return self._answered.count(False) / len(self._answered)
        return self._reported_loss
