"""Whether a drone sends more than its share, and the mildest measure against it, which the tower takes by itself.

Counted in windows of WINDOW_S. Too many texts or alerts mute the drone, too many frames or reports limit its telemetry.
Neither touches its flight: sticks, commands and holds go on. It ends when the drone has been quiet for QUIET_S.
Sans-I/O: takes `now`.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Final

from server.kernel.restraint import Measure
from server.link.core.token_bucket import TokenBucket
from wire.state_messages import StateKey, state_key

WINDOW_S: Final = 10.0
QUIET_S: Final = 60.0
QUIET: Final = 0.5
"""Below this part of every limit a drone is quiet."""

TEXTS_PER_S: Final = 5.0
"""STATUSTEXT and EVENT, as they come: an autopilot repeats its faults before arming, and not so often."""
ALERTS_PER_S: Final = 2.0
"""That open. A crash opens a dozen, once."""
FRAMES_PER_S: Final = 2_000.0
"""A fifth of what an agent may send (`FloodLimits`)."""
REPORTS_PER_S: Final = 20.0
"""Of the agent: state, holds, plans, parameters. A few while it holds."""

LIMITED_EVERY_S: Final = 0.5
"""How often each kind of state passes while its telemetry is limited."""
LIMITED_PER_S: Final = 100.0
LIMITED_BURST: Final = 200.0
"""State of all kinds."""
LIMITED_OTHERS_PER_S: Final = 50.0
LIMITED_OTHERS_BURST: Final = 500.0
"""Frames that are no state: acknowledgements, parameters, plans."""
MAX_KINDS: Final = 500
"""Remembered while limited: a hostile vehicle makes up components without end."""


@dataclass(frozen=True, slots=True)
class Heard:
    """How much of something came in one window."""

    words: str
    per_s: float
    limit_per_s: float
    measure: Measure


class NoiseWatch:
    """Of one drone, while the tower runs. Whoever hears something of it adds to the counters."""

    __slots__ = ("_began_at", "_quiet_since", "alerts", "frames", "measures", "reports", "since", "texts", "words")

    def __init__(self) -> None:
        self.frames = 0
        self.texts = 0
        self.reports = 0
        self.alerts = 0
        self.measures: frozenset[Measure] = frozenset()
        """What the tower does about it by itself."""
        self.words = ""
        """What it sends and what is done about it: the end of a sentence; empty: it is not noisy."""
        self.since: datetime | None = None
        self._began_at: float | None = None
        self._quiet_since: float | None = None

    def look(self, now: float, at: datetime) -> bool:
        """Once a second. Whether the measures have changed."""
        if self._began_at is None:
            self._begin(now)
            return False
        took_s = now - self._began_at
        if took_s < WINDOW_S:
            return False
        heard = self._heard(took_s)
        self._begin(now)
        loud = [one for one in heard if one.per_s > one.limit_per_s]
        if loud:
            self._quiet_since = None
            return self._take(loud, at)
        if not self.measures:
            return False
        if any(one.per_s > one.limit_per_s * QUIET for one in heard):
            self._quiet_since = None
            return False
        if self._quiet_since is None:
            self._quiet_since = now - took_s
        if now - self._quiet_since < QUIET_S:
            return False
        self.measures, self.words, self.since, self._quiet_since = frozenset(), "", None, None
        return True

    def _begin(self, now: float) -> None:
        self._began_at = now
        self.frames = self.texts = self.reports = self.alerts = 0

    def _heard(self, took_s: float) -> tuple[Heard, ...]:
        texts_s, alerts_s = self.texts / took_s, self.alerts / took_s
        frames_s, reports_s = self.frames / took_s, self.reports / took_s
        return (
            Heard(f"{texts_s:.0f} texts", texts_s, TEXTS_PER_S, Measure.MUTED),
            Heard(f"{alerts_s:.0f} alerts", alerts_s, ALERTS_PER_S, Measure.MUTED),
            Heard(f"{frames_s:.0f} frames", frames_s, FRAMES_PER_S, Measure.LIMITED),
            Heard(f"{reports_s:.0f} reports", reports_s, REPORTS_PER_S, Measure.LIMITED),
        )

    def _take(self, loud: list[Heard], at: datetime) -> bool:
        measures = self.measures | {one.measure for one in loud}
        if measures == self.measures:
            return False
        self.measures, self.since = measures, self.since or at
        sent = " and ".join(one.words for one in loud)
        self.words = f"{sent} a second{_done(measures)} until it has been quiet for {QUIET_S:.0f} s"
        return True


def _done(measures: frozenset[Measure]) -> str:
    done = []
    if Measure.MUTED in measures:
        done.append("its texts, and alerts that are not critical, reach only whoever flies it")
    if Measure.LIMITED in measures:
        done.append("its telemetry is passed on twice a second")
    return f": {', and '.join(done)},"


class LimitedTelemetry:
    """Which frames of a limited drone pass. The newest state of each kind does, twice a second."""

    def __init__(self, now: float) -> None:
        self._passed: dict[StateKey, float] = {}
        self._state = TokenBucket(LIMITED_PER_S, LIMITED_BURST, now)
        self._others = TokenBucket(LIMITED_OTHERS_PER_S, LIMITED_OTHERS_BURST, now)

    def admitted(self, frames: list[bytes], now: float) -> tuple[list[bytes], int]:
        """Returns those that pass, in order, and how many were dropped that are no state."""
        passed, lost = [], 0
        for frame in frames:
            key = state_key(frame)
            if key is None:
                if self._others.take(1.0, now):
                    passed.append(frame)
                else:
                    lost += 1
            elif now - self._passed.get(key, float("-inf")) >= LIMITED_EVERY_S and self._state.take(1.0, now):
                if len(self._passed) >= MAX_KINDS:
                    self._passed.clear()
                self._passed[key] = now
                passed.append(frame)
        return passed, lost
