"""Estimates how fast the link accepts data and how much the pictures may use, from delays alone. No I/O.

It has two results. `pacing_bps`: how fast bytes leave this machine, kept a little below the capacity of the link, so
that a key picture waits here and not in a modem's queue ahead of the drone's telemetry. `budget_bps`: what all streams
together may produce, kept below the pacing, so that nothing waits long here either.

The largest units measure the capacity: a unit sent faster than the link is late in proportion to its size. While they
arrive in time the pacing is raised, quickly at first and in small steps near the last bound. If every unit of a period
is late there is a queue: both numbers then drop at once below the measured throughput.

All delays come from the tower's answers (wire.video.Got). A packet that TCP retransmits delays one unit and its
followers, but not all units of a period; it lowers nothing.
"""

import math
from collections import deque
from itertools import pairwise
from typing import Final, NamedTuple

from onboard_agent.video.core.units_in_transit import Arrival, Sent, UnitsInTransit
from wire.video import Got

FIRST_PACING_BPS: Final = 1_000_000.0
MIN_PACING_BPS: Final = 60_000.0
MAX_PACING_BPS: Final = 100_000_000.0
"""At this rate a key picture is sent within 5 ms; a higher rate gains nothing."""

FIRST_BUDGET_BPS: Final = 300_000.0
MIN_BUDGET_BPS: Final = 20_000.0
BUDGET_SHARE: Final = 0.75
"""Share of the pacing: a key picture is several times as large as other pictures, and must leave quickly."""

BELOW: Final = 0.95
"""Pacing, as a share of the measured capacity of the link."""
SLOWER: Final = 0.9
"""Below this share of the pacing, the link is slower than the pacing."""
SAMPLES_OVER_S: Final = 3.0
MIN_SAMPLES: Final = 3
"""A single sample may be distorted by a lost packet."""

STEP_FIRST: Final = 2.0
STEP_FAR: Final = 1.25
STEP_NEAR: Final = 1.08
NEAR: Final = (0.7, 1.15)
"""Range around the last bound, as shares of it."""

RISE_FIRST: Final = 1.0
RISE: Final = 0.25
"""Rise of the budget per second, before and after the first bound was found."""
RISE_REST_S: Final = 1.5

QUEUE_S: Final = 0.02
"""If all units of a period are later than this plus the noise, there is a queue."""
QUEUE_WHILE_S: Final = 0.4
QUEUE_UNITS: Final = 4
AFTER_QUEUE: Final = (0.5, 0.7)
"""Budget, as a share of the capacity of the link, so that the queue drains."""
QUEUE_GONE_S: Final = 0.5
EMPTIED_OVER_S: Final = 0.05
SLOWEST_LEFT_OUT: Final = 0.34
"""Share of the units in a queue that is ignored: a few of them may have met a lost packet."""
LESS: Final = 0.85
"""Budget factor if the queue does not show how fast it is served: units that arrive all at once were delayed by a lost
packet or a busy computer, not by a slow link."""

HOPED_SHARE: Final = 0.75
"""Share of the budget that the link had in its previous use."""
SHOWN_FOR_S: Final = 0.3
MAX_PROBED_BPS: Final = 10_000_000.0
"""Maximum pacing taken from memory; it soon rises by itself."""

LATE_S: Final = 0.1
WAITING_S: Final = 0.08
"""No picture is encoded while units are late by more than LATE_S, or wait here longer than WAITING_S."""
STIR_FOR_S: Final = 2.0
"""Beyond this delay the link itself is down."""
HOPELESS_S: Final = 4.0


class Known(NamedTuple):
    """What is known of a link. `bound_bps`: its last known upper bound. `base_s`: round-trip time."""

    pacing_bps: float
    budget_bps: float
    bound_bps: float | None
    base_s: float


class _Sample(NamedTuple):
    """From one large burst: its send rate, and its arrival rate."""

    at: float
    offered_bps: float
    carried_bps: float


class LinkRate:
    """Report to it what is sent and acknowledged; query it before each picture."""

    def __init__(self, now: float) -> None:
        self.way = UnitsInTransit()
        self.pacing_bps = FIRST_PACING_BPS
        self.queues = 0
        """Number of queues detected."""
        self._budget_bps = FIRST_BUDGET_BPS
        self._bound_bps: float | None = None
        """The last observed upper bound of the link."""
        self._samples: deque[_Sample] = deque()
        self._recent: deque[Arrival] = deque()
        self._previous_late_s = 0.0
        self._burst_clear = True
        """There was no queue before the current burst."""
        self._rested_at = now
        """The budget does not rise until RISE_REST_S after this time."""
        self._stepped_at = now
        self._risen_at = now
        self._cut_at: float | None = None
        self._cut_late_s = 0.0
        self._hoped: Known | None = None
        """Earlier knowledge of the link, until the first unit shows whether it still holds."""
        self._shown_at = float("-inf")

    @property
    def budget_bps(self) -> float:
        """For all streams together, including headers."""
        return self._budget_bps

    # -- events ----------------------------------------------------------------------------------------------------

    def sent(self, got: Got, unit_bytes: int, now: float) -> Sent:
        """Takes a unit handed over now; `got` is the tower's expected answer. Returns when the unit has to leave."""
        return self.way.sent(got, unit_bytes, self.pacing_bps, now)

    def got(self, got: Got, now: float) -> None:
        """Takes the tower's answer for a unit."""
        arrival = self.way.got(got, now)
        if arrival is None:
            return
        self._judge_hope(arrival, now)
        self._recent.append(arrival)
        while now - self._recent[0].at > self._while_s and len(self._recent) > QUEUE_UNITS:
            self._recent.popleft()
        if not self._judge_queue(now):
            self._sample(arrival, now)
            self._rise(now)
        self._previous_late_s = arrival.late_s

    def reconnected(self, now: float) -> None:
        """A new connection: nothing is in transit, and the route may differ. Limits the rates to the first ones."""
        self.way.forget()
        self._recent.clear()
        self._samples.clear()
        self._cut_at = self._hoped = None
        self._previous_late_s = 0.0
        self._budget_bps = max(MIN_BUDGET_BPS, min(self._budget_bps, FIRST_BUDGET_BPS))
        self.pacing_bps = max(MIN_PACING_BPS, min(self.pacing_bps, FIRST_PACING_BPS))
        self._rested_at = self._stepped_at = self._risen_at = now

    def begin(self, now: float, hoped: Known | None = None) -> None:
        """Another stream, perhaps over another link. `hoped`: earlier knowledge of this link; it counts once the first
        unit, no larger than without it, arrives in the time that it predicts."""
        self.pacing_bps, self._budget_bps, self._bound_bps = FIRST_PACING_BPS, FIRST_BUDGET_BPS, None
        self.reconnected(now)
        self._hoped = hoped
        if hoped is not None:
            self.pacing_bps = max(MIN_PACING_BPS, min(hoped.pacing_bps, MAX_PROBED_BPS))
            self._budget_bps = max(MIN_BUDGET_BPS, min(hoped.budget_bps, FIRST_BUDGET_BPS))
            self._bound_bps = hoped.bound_bps
            self.way.expect(hoped.base_s, now)

    @property
    def known(self) -> Known | None:
        """For `begin` of another stream over the same link. None: nothing is known yet."""
        if not self._recent or self._hoped is not None:
            return None
        return Known(self.pacing_bps, self._budget_bps, self._bound_bps, self.way.base_s)

    def is_free(self, now: float) -> bool:
        """No limit was found so far, or a unit has just confirmed a higher rate."""
        return (self._bound_bps is None and self._cut_at is None) or now < self._shown_at + SHOWN_FOR_S

    # -- queries ---------------------------------------------------------------------------------------------------

    def has_room(self, now: float) -> bool:
        """Whether another picture may be encoded now. An encoded picture must be sent."""
        way = self.way
        return way.late_s(now) <= LATE_S + way.noise_s and way.waiting_s(now) <= WAITING_S

    def is_overdue(self, now: float) -> bool:
        """An answer is overdue. While nothing is sent, TCP detects a loss only by a timer of a fifth of a second or
        more, doubled each time: a few bytes now and then show TCP what has arrived."""
        return QUEUE_S + self.way.noise_s < self.way.late_s(now) < STIR_FOR_S

    def is_hopeless(self, now: float) -> bool:
        """Nothing gets through any more; a new connection might."""
        return self.way.oldest_s(now) > HOPELESS_S + self.way.base_s

    # -- estimation ------------------------------------------------------------------------------------------------

    def _judge_hope(self, first: Arrival, now: float) -> None:
        hoped, self._hoped = self._hoped, None
        if hoped is None:
            return
        if first.late_s <= QUEUE_S + self.way.noise_s:
            self._budget_bps = max(self._budget_bps, HOPED_SHARE * hoped.budget_bps)
            self._shown_at = now
        else:
            self.pacing_bps, self._bound_bps = min(self.pacing_bps, FIRST_PACING_BPS), None
            self.way.rebase()

    @property
    def _while_s(self) -> float:
        return max(QUEUE_WHILE_S, 3 * self.way.base_s)

    def _judge_queue(self, now: float) -> bool:
        """Returns whether there is a queue, and lowers the rates for it, at most once per period."""
        recent = self._recent
        if len(recent) < QUEUE_UNITS or now - recent[0].at < 0.8 * self._while_s:
            return False
        least_late_s = min(arrival.late_s for arrival in recent)
        if least_late_s <= QUEUE_S + self.way.noise_s:
            return False
        if self._cut_at is not None and now - self._cut_at < self._while_s + self.way.base_s + self._cut_late_s:
            return True  # the effect shows only after everything in transit has arrived
        through_bps = sum(arrival.sent.bits for arrival in list(recent)[1:]) / (now - recent[0].at)
        if self._is_longer_way(least_late_s, through_bps, now):
            self.way.rebase()
            recent.clear()
            self._cut_at = None
            return True
        carries = self._emptied_bps()
        self.queues += 1
        self._samples.clear()
        if carries is None:
            self._budget_bps = max(MIN_BUDGET_BPS, LESS * self._budget_bps)
        else:
            carries = self._bound_bps = min(self.pacing_bps, carries)
            self.pacing_bps = max(MIN_PACING_BPS, min(self.pacing_bps, BELOW * carries))
            self._budget_bps = max(MIN_BUDGET_BPS, min(self._budget_bps, self._after(least_late_s) * carries))
        self._cut_at, self._cut_late_s = now, least_late_s
        self._rested_at = self._stepped_at = now
        return True

    def _emptied_bps(self) -> float | None:
        """How fast the queue was served. Uses the units that were in the queue when their predecessor arrived, except
        the slowest: a slow link delays all units, a packet that TCP retransmits delays one."""
        served = sorted(
            ((arrival.at - before.at) / arrival.sent.bits, arrival.sent.bits)
            for before, arrival in pairwise(self._recent)
            if arrival.sent.leaves_at + self.way.base_s <= before.at
        )
        relevant = served[: len(served) - math.ceil(SLOWEST_LEFT_OUT * len(served))]
        bits = sum(bits for _, bits in relevant)
        took_s = sum(s_per_bit * bits for s_per_bit, bits in relevant)
        return bits / took_s if took_s >= EMPTIED_OVER_S else None

    @staticmethod
    def _after(late_s: float) -> float:
        """The share of the link that lets the queue drain within QUEUE_GONE_S."""
        least, most = AFTER_QUEUE
        return max(least, min(most, 1 - late_s / QUEUE_GONE_S))

    def _is_longer_way(self, least_late_s: float, through_bps: float, now: float) -> bool:
        """Less was sent than gets through, and it did not help: the queue is caused by others, or there is none."""
        return (
            self._cut_at is not None
            and now - self._cut_at < 2 * (self._while_s + self.way.base_s + self._cut_late_s)
            and least_late_s > 0.9 * self._cut_late_s
            and through_bps >= 0.8 * self._budget_bps
        )

    def _sample(self, arrival: Arrival, now: float) -> None:
        sent = arrival.sent
        if sent.begins_burst:
            self._burst_clear = self._previous_late_s <= QUEUE_S + self.way.noise_s
        if not (self._burst_clear and arrival.large and sent.burst_s > 0):
            return
        late_s = max(0.0, arrival.late_s - self.way.noise_s)
        offered_bps, carried_bps = sent.burst_bits / sent.burst_s, sent.burst_bits / (sent.burst_s + late_s)
        self._samples.append(_Sample(now, offered_bps, carried_bps))
        while now - self._samples[0].at > SAMPLES_OVER_S:
            self._samples.popleft()
        if carried_bps >= SLOWER * offered_bps:
            if carried_bps >= SLOWER * self.pacing_bps and now - self._stepped_at >= self._step_rest_s:
                self.pacing_bps = min(MAX_PACING_BPS, self.pacing_bps * self._step())
                self._stepped_at = now
            return
        relevant = [sample.carried_bps for sample in self._samples if sample.offered_bps >= SLOWER * self.pacing_bps]
        carries_bps = max(relevant, default=0.0)
        if len(relevant) >= MIN_SAMPLES and carries_bps < SLOWER * self.pacing_bps:
            self._bound_bps = carries_bps
            self.pacing_bps = max(MIN_PACING_BPS, BELOW * carries_bps)
            self._budget_bps = max(MIN_BUDGET_BPS, min(self._budget_bps, BUDGET_SHARE * self.pacing_bps))
            self._stepped_at = now

    @property
    def _step_rest_s(self) -> float:
        return max(0.2, 2 * self.way.base_s)

    def _step(self) -> float:
        bound = self._bound_bps
        if bound is None:
            return STEP_FIRST
        least, most = NEAR
        if self.pacing_bps > most * bound:
            self._bound_bps = None if self.pacing_bps > 2 * most * bound else bound
            return STEP_FAR
        return STEP_NEAR if self.pacing_bps > least * bound else STEP_FAR

    def _rise(self, now: float) -> None:
        """Raises the budget slowly towards its limit by the pacing; lowers it at once."""
        passed_s = min(0.5, now - self._risen_at)
        self._risen_at = now
        most = BUDGET_SHARE * self.pacing_bps
        if self._budget_bps >= most:
            self._budget_bps = max(MIN_BUDGET_BPS, most)
        elif self._recent[-1].late_s > QUEUE_S + self.way.noise_s:
            return  # units are late already
        elif now - self._rested_at >= RISE_REST_S or self._bound_bps is None:
            rise = RISE_FIRST if self._bound_bps is None else RISE
            self._budget_bps = min(most, self._budget_bps * (1 + rise * passed_s))
