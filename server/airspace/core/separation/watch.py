"""The watch over all drones in the air, of all owners: which pairs will come too close. No I/O; takes `now`.

Once a second it searches all drones for possible pairs (`near_pairs`), in portions. It checks those pairs twice a
second until they are apart (`encounter`).
"""

from collections.abc import Callable, Iterator, Mapping
from itertools import count
from typing import Final, NamedTuple

from server.airspace.core.separation.bounds import Level, SeparationBounds, judge
from server.airspace.core.separation.encounter import Encounter
from server.airspace.core.separation.motion import Motion, Relative
from server.airspace.core.separation.near_pairs import Pair, near_pairs
from wire.ids import DroneId

SWEEP_S: Final = 1.0
CHECK_EVERY_S: Final = 0.5
MAX_PAIRS: Final = 10_000
"""Maximum number of pairs that one sweep checks closely. People do not fly a thousand drones on top of each other."""
MAX_ENCOUNTERS: Final = 300
"""The others wait until one of these is over."""


class AirPicture(NamedTuple):
    """The watch's view of the world. `flying`: drones in the air with a fresh position. `motion`: the newest motion of
    one drone, however old; None if it is on the ground or gone. `concerns`: whether a pair is this tower's to watch."""

    flying: Callable[[float], Mapping[DroneId, Motion]]
    motion: Callable[[DroneId], Motion | None]
    concerns: Callable[[Pair], bool] = lambda pair: True


class SeparationWatch:
    """One for the tower. Call `tick` about ten times a second; it returns the alerts to send.

    `new_number`: identifies an encounter to people. Consecutive numbers, the default, reveal how many others there are.
    """

    def __init__(self, sky: AirPicture, bounds: SeparationBounds, new_number: Callable[[], int] | None = None) -> None:
        self.bounds = bounds
        self._sky = sky
        self._encounters: dict[Pair, Encounter] = {}
        self._portions: Iterator[list[Pair]] | None = None
        self._swept_at = self._checked_at = float("-inf")
        self._new_number = new_number or count(1).__next__
        self.cut_short = 0
        """How often there was more than could be looked at."""

    @property
    def encounters(self) -> list[Encounter]:
        """The open alerts, worst first."""
        active = [one for one in self._encounters.values() if one.level is not Level.CLEAR]
        return sorted(active, key=lambda one: (-one.level, one.judged.approach.in_s if one.judged else 0.0))

    def tick(self, now: float) -> list[Encounter]:
        """Those whose level changed: an encounter whose `over` is set is named for the last time."""
        if not self.bounds.horizontal_m:
            return []
        changed = []
        if now - self._checked_at >= CHECK_EVERY_S:
            self._checked_at = now
            changed = [one for one in list(self._encounters.values()) if self._check(one, now)]
        return changed + self._sweep(now)

    def _sweep(self, now: float) -> list[Encounter]:
        if self._portions is None:
            if now - self._swept_at < SWEEP_S:
                return []
            self._swept_at = now
            flying = self._sky.flying(now)
            if len(flying) < 2:
                return []
            self._portions = self._near(flying, now)
        portion = next(self._portions, None)
        if portion is None:
            self._portions = None
            return []
        changed = []
        for pair in portion:
            one = self._suspected(pair, now)
            if one is not None and self._check(one, now):
                changed.append(one)
        return changed

    def _near(self, flying: Mapping[DroneId, Motion], now: float) -> Iterator[list[Pair]]:
        found = 0
        for portion in near_pairs(flying, self.bounds, now, most_pairs=MAX_PAIRS, wanted=self._sky.concerns):
            found += len(portion)
            yield portion
        self.cut_short += found >= MAX_PAIRS

    def _suspected(self, pair: Pair, now: float) -> Encounter | None:
        if pair in self._encounters:
            return None
        own, other = (self._sky.motion(drone_id) for drone_id in pair)
        if own is None or other is None or not judge(own, other, Relative.of(own, other, now), self.bounds, now):
            return None
        if len(self._encounters) >= MAX_ENCOUNTERS:
            self.cut_short += 1
            return None
        one = self._encounters[pair] = Encounter(self._new_number(), pair)
        return one

    def _check(self, one: Encounter, now: float) -> bool:
        if self._sky.concerns(one.pair):
            own, other = (self._sky.motion(drone_id) for drone_id in one.pair)
            changed = one.check(own, other, self.bounds, now)
        else:
            changed = one.leave()
        if one.over:
            del self._encounters[one.pair]
        return changed
