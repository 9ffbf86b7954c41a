"""Round trip and loss of a link.

One side leads, the agent: it sends pings, each with its measurements. So the tower knows as much without pings and
timers of its own, which would be most of its work for a thousand links. Only while somebody flies does it ping too
(`watch_closely`), because it must then notice missing answers itself and at once.

The leading side may ping less often when nothing depends on it (`at_leisure`). After an unanswered ping the next one
follows as early as ever, and so does every ping while the other side pings too. Takes `now` (seconds, monotonic); reads
no clock.
"""

from collections import deque
from typing import Final

from wire.content import LOST_OF, Ping, Pong

PING_INTERVAL_S: Final = 0.5
"""Two a second: the 2 s after which a silent link counts as lost then spans four of them."""

LEISURE_S: Final = 1.0
"""The interval where there is time, and the last ping was answered."""

CLOSE_S: Final = 2.0
"""The leading side does not slow down for this long after a ping of the other side."""

ANSWER_WITHIN_S: Final = 2.0
"""A ping not answered by then counts as lost."""

PROBE_SEQUENCES: Final = 1 << 31
"""Sequence numbers from here on are those of probes, which are no part of this measurement."""

REMEMBERED: Final = 20
"""Pings over which loss is measured: ten seconds, or twenty at leisure."""

_MAX_REPORTED_US: Final = (1 << 32) - 1
_NEVER: Final = float("inf")


class Keepalive:
    """One side's view of a link. Ask `ping_due`; feed it pongs and the other side's pings; read `rtt_s`, `loss`."""

    def __init__(self, now: float, *, leads: bool = True) -> None:
        self._leads = leads
        self._pings = leads
        """Whether pings are sent at all at the moment."""
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
        """When the other side was last heard: set it with each authentic datagram."""
        self.rtt_s: float | None = None
        """Smoothed round trip, or None before the first answer."""

    def watch_closely(self, closely: bool, now: float) -> None:
        """Whether the side that does not lead measures by itself. Without effect on the one that leads."""
        if self._leads or closely == self._pings:
            return
        self._pings = closely
        self.next_ping_at = now if closely else _NEVER
        self._waiting.clear()
        self._answered.clear()

    def at_leisure(self, leisure: bool) -> None:
        """Whether the side that leads may take its time. Nothing changes for the other one."""
        if self._leads:
            self._leisure = leisure
            if not leisure:
                self._no_later_than_usual()

    @property
    def rests_s(self) -> float:
        """How much longer than the usual interval silence is normal: subtract it before judging by silence or by
        missing proof."""
        if self._leads:
            return self._rests_s
        return 0.0 if self._pings else LEISURE_S - PING_INTERVAL_S

    def _no_later_than_usual(self) -> None:
        self.next_ping_at = min(self.next_ping_at, self._pinged_at + PING_INTERVAL_S)

    def ping_due(self, now: float) -> Ping | None:
        """A ping to send now, or None. Never more than one for each PING_INTERVAL_S, but for those that went along."""
        return None if now < self.next_ping_at else self.ping(now)

    def ping(self, now: float) -> Ping:
        """A ping to send now, due or not: the next one is due an interval later."""
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
        """The path has changed: the next ping is due now, to tell the other side."""
        if self._pings:
            self.next_ping_at = now

    def pong(self, pong: Pong, now: float) -> float | None:
        """An answer arrived: its round trip in seconds. None for a late or repeated one."""
        sent = self._waiting.pop(pong.sequence, None)
        if sent is None:
            return None
        self._answered.append(True)
        self._newest_answered = max(self._newest_answered, pong.sequence)
        if self._leads and pong.sequence == self._sequence:
            leisure = self._leisure and now >= self._close_until
            self._rests_s = LEISURE_S - PING_INTERVAL_S if leisure else 0.0
            if self.next_ping_at == sent + PING_INTERVAL_S:  # else it is to hurry
                self.next_ping_at += self._rests_s
        sample = max(0.0, now - sent)
        self._unreported_us = min(max(round(sample * 1e6), 1), _MAX_REPORTED_US)
        self._smooth(sample)
        return sample

    def receive_ping(self, ping: Ping, now: float) -> float | None:
        """The other side's ping: the round trip it reports, in seconds. None if this side measures by itself."""
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
        """The round trip, or how long an answer is overdue if that is longer; 0 before anything is known.

        A ping whose successor has been answered was lost, which is not the same as slow.
        """
        open_since = [sent for sequence, sent in self._waiting.items() if sequence > self._newest_answered]
        waiting = now - min(open_since) if open_since else 0.0
        return max(self.rtt_s or 0.0, waiting if waiting > PING_INTERVAL_S else 0.0)

    def silent_for(self, now: float) -> float:
        """Seconds since the other side was last heard."""
        return now - self.heard_at

    @property
    def loss(self) -> float:
        """Share of the last pings without an answer, 0..1."""
        if self._answered:
            return self._answered.count(False) / len(self._answered)
        return self._reported_loss
