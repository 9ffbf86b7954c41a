"""Selects the profile that a link can carry, from measurements: down at once, up slowly. No I/O; takes `now`.

A link that is too narrow shows one of two signs: packets are lost, or they queue (the round trip grows beyond that of
the unloaded link). A link with a merely long delay, such as a satellite's, shows neither.

A step up is an attempt. If the link does not carry it, the next attempt waits twice as long, up to MAX_BACKOFF_FACTOR
times, so that a link with room for `thin` and no more is not disturbed every half minute.
"""

from collections import deque
from typing import Final, NamedTuple

from wire.stream_profiles import StreamProfile


class Measured(NamedTuple):
    """Current measurements of the link. Losses are shares, 0..1, of what the agent sends."""

    loss: float
    """Loss over LOSS_OVER_S."""
    loss_now: float
    """Loss over LOSS_NOW_OVER_S."""
    rtt_s: float | None
    """The round trip, overdue responses included; None before the first."""


class Limits(NamedTuple):
    """Share of packets lost, and seconds of queueing."""

    loss: float
    queueing_s: float


WORST_FOR: Final = {
    StreamProfile.FULL: Limits(0.10, 0.5),
    StreamProfile.THIN: Limits(0.25, 1.5),
}
"""At or beyond either limit, the link does not carry the profile."""

LOSS_OVER_S: Final = 30.0
LOSS_NOW_OVER_S: Final = 5.0
LOSS_NOW_FACTOR: Final = 3.0
"""A loss this many times the limit need not last for LOSS_OVER_S. One or two of the few packets in five seconds may
always be missing."""

AT_EASE: Final = Limits(0.04, 0.2)
"""Below both limits there may be room for more. Between these and WORST_FOR the profile does not change."""

DOWN_AFTER_S: Final = 1.0
"""A single late response is not a trend."""

MIN_STAY_S: Final = 3.0
"""Minimum time before the next step down: the measurement must show the effect of the previous step."""

UP_AFTER_S: Final = 20.0
"""After this time below AT_EASE, one step up."""

FAILED_WITHIN_S: Final = 30.0
"""A step down this soon after a step up means that the attempt has failed."""

MAX_BACKOFF_FACTOR: Final = 8

USUAL_OVER_S: Final = 60.0
"""The shortest round trip in this time is that of the path without a queue."""


class AutoProfile:
    """Feed `measured` a few times a second; read `profile` and `why`."""

    def __init__(self) -> None:
        self.profile = StreamProfile.FULL
        self.why = "nothing speaks against it"
        self._least_rtts: deque[tuple[float, float]] = deque()
        self._too_much_since: float | None = None
        self._at_ease_since: float | None = None
        self._changed_at = float("-inf")
        self._went_up_at = float("-inf")
        self._patience = 1

    def new_link(self) -> None:
        """Forgets round trips, because the path may have changed. The profile stays until the next measurement."""
        self._least_rtts.clear()
        self._too_much_since = self._at_ease_since = None

    def measured(self, measured: Measured, now: float) -> None:
        """Takes a measurement of the link."""
        rtt_s = measured.rtt_s
        queueing_s = 0.0 if rtt_s is None else rtt_s - self._usual_rtt_s(rtt_s, now)
        loss = max(measured.loss, measured.loss_now / LOSS_NOW_FACTOR)
        wanted = self._carried(loss, queueing_s)
        if wanted is None:
            self._too_much_since = None
        else:
            self._down(wanted, measured, queueing_s, now)
        if loss < AT_EASE.loss and queueing_s < AT_EASE.queueing_s:
            self._up(now)
        else:
            self._at_ease_since = None

    def _carried(self, loss: float, queueing_s: float) -> StreamProfile | None:
        """Returns the richest profile that the link carries, if it is below the present one, else None."""
        order = list(StreamProfile)
        for profile in order[order.index(self.profile) :]:
            limits = WORST_FOR.get(profile)
            if limits is None or (loss < limits.loss and queueing_s < limits.queueing_s):
                return None if profile is self.profile else profile
        return None

    def _down(self, wanted: StreamProfile, measured: Measured, queueing_s: float, now: float) -> None:
        if self._too_much_since is None:
            self._too_much_since = now
        if now - self._too_much_since < DOWN_AFTER_S or now - self._changed_at < MIN_STAY_S:
            return
        if now - self._went_up_at < FAILED_WITHIN_S:
            self._patience = min(2 * self._patience, MAX_BACKOFF_FACTOR)
        limit = WORST_FOR[self.profile].loss
        if measured.loss >= limit:
            why = f"{measured.loss:.0%} of the packets are lost"
        elif measured.loss_now >= limit * LOSS_NOW_FACTOR:
            why = f"{measured.loss_now:.0%} of the packets are lost"
        else:
            why = f"the round trip is {queueing_s * 1000:.0f} ms longer than usual"
        self._change(wanted, why, now)

    def _up(self, now: float) -> None:
        if self._at_ease_since is None:
            self._at_ease_since = now
        order = list(StreamProfile)
        at = order.index(self.profile)
        if at == 0:
            if now - self._went_up_at > FAILED_WITHIN_S:
                self._patience = 1
            return
        ease_s = now - self._at_ease_since
        if ease_s >= UP_AFTER_S * self._patience:
            self._went_up_at = now
            self._change(order[at - 1], f"the link has been at ease for {ease_s:.0f} s", now)

    def _change(self, profile: StreamProfile, why: str, now: float) -> None:
        self.profile, self.why = profile, why
        self._changed_at = now
        self._too_much_since = self._at_ease_since = None

    def _usual_rtt_s(self, rtt_s: float, now: float) -> float:
        """Returns the shortest round trip in USUAL_OVER_S. Each stored candidate is the shortest since its own time."""
        least = self._least_rtts
        while least and least[0][0] <= now - USUAL_OVER_S:
            least.popleft()
        while least and least[-1][1] >= rtt_s:
            least.pop()
        least.append((now, rtt_s))
        return least[0][1]
