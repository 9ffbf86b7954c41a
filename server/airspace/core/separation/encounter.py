"""A pair of drones that may come close, and the alert about it. Takes `now`; a small state machine.

    suspected --(the conflict lasts, or begins soon)--> caution / warning --(over for long enough)--> clear

Levels do not flicker. A level rises after it was found for LASTS_S, or for a quarter of the remaining time if that is
longer (at once if it begins within SOON_S). It falls after it was not found for OVER_S, by distances a quarter larger
than those that raised it. So a drone that turns at the end of a line towards its neighbour's raises no alert.
"""

from typing import Final, Literal

from server.airspace.core.separation.bounds import STALE_S, Judged, Level, SeparationBounds, judge
from server.airspace.core.separation.motion import Motion, Relative
from server.airspace.core.separation.near_pairs import Pair

LASTS_S: Final = 1.4
SOON_S: Final = 5.0
LASTS_SHARE: Final = 0.25
OVER_S: Final = 3.0
WIDENED: Final = 1.25
UNHEARD_S: Final = 10.0
"""An alert about a drone that fell silent stays this long: silence does not mean that it went away."""

Why = Literal["", "apart", "landed", "unheard", "elsewhere"]
"""`landed`: or removed from the tower. `elsewhere`: other towers watch both drones now; nobody is told that."""


class Encounter:
    """`number` identifies it to people from the first alert to the end. Call `look` repeatedly until `over` has a
    reason."""

    def __init__(self, number: int, pair: Pair) -> None:
        self.number = number
        self.pair = pair
        self.level = Level.CLEAR
        self.judged: Judged | None = None
        """The newest prediction; of the widened distances where only those are still kept."""
        self.seen: Relative | None = None
        """The second drone as seen from the first; None while one of them is silent."""
        self.over: Why = ""
        self._higher_since: dict[Level, float] = {}
        self._lower_since: float | None = None
        self._lower_to = Level.CLEAR
        """The highest that was found since then."""
        self._unheard_since: float | None = None

    def check(self, own: Motion | None, other: Motion | None, bounds: SeparationBounds, now: float) -> bool:
        """Takes the positions of both (None: on the ground, or gone). Returns whether the alert level changed."""
        if own is None or other is None:
            return self._end("landed")
        if now - min(own.at, other.at) > STALE_S:
            return self._check_unheard(now)
        self._unheard_since = None
        self.seen = Relative.of(own, other, now)
        found = judge(own, other, self.seen, bounds, now)
        kept = found
        if self.level is not Level.CLEAR and (found is None or found.level < self.level):
            kept = judge(own, other, self.seen, bounds, now, widened=WIDENED)
        self.judged = kept
        if found is not None and found.level > self.level:
            self._lower_since = None
            return self._check_higher_levels(found, now)
        self._higher_since.clear()
        if self.level is Level.CLEAR:
            return self._end("apart")
        if kept is not None and kept.level >= self.level:
            self._lower_since = None
            return False
        return self._check_lower_level(kept.level if kept is not None else Level.CLEAR, now)

    def leave(self) -> bool:
        """Both drones are at other towers now. Returns whether the alert level changed."""
        return self._end("elsewhere")

    def _check_higher_levels(self, found: Judged, now: float) -> bool:
        for level in [one for one in self._higher_since if one > found.level]:
            del self._higher_since[level]
        for level in (Level.CAUTION, Level.WARNING):
            if self.level < level <= found.level:
                self._higher_since.setdefault(level, now)
        begins_s = found.approach.begins_s
        lasts_s = max(LASTS_S, LASTS_SHARE * begins_s)
        ready = [level for level, since in self._higher_since.items() if now - since >= lasts_s]
        raised = found.level if begins_s < SOON_S else max(ready, default=self.level)
        if raised <= self.level:
            return False
        self.level = raised
        self._higher_since = {level: since for level, since in self._higher_since.items() if level > raised}
        return True

    def _check_lower_level(self, level: Level, now: float) -> bool:
        if self._lower_since is None:
            self._lower_since, self._lower_to = now, level
        self._lower_to = max(self._lower_to, level)
        if now - self._lower_since < OVER_S:
            return False
        self._lower_since = None
        if self._lower_to is Level.CLEAR:
            return self._end("apart")
        self.level = self._lower_to
        return True

    def _check_unheard(self, now: float) -> bool:
        self.seen = None
        if self._unheard_since is None:
            self._unheard_since = now
        if self.level is not Level.CLEAR and now - self._unheard_since < UNHEARD_S:
            return False
        return self._end("unheard")

    def _end(self, why: Why) -> bool:
        was, self.level = self.level, Level.CLEAR
        self.judged, self.seen, self.over = None, None, why
        return was is not Level.CLEAR
