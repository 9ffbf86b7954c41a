"""Who is told that two drones come near each other: everybody who gets the frames of either. A part of the hub.

Whoever may not see the other drone is told that there is one, where it is and how high, and not which: they can keep
away from it, and learn nothing else about somebody else's squad.
"""

from typing import Final, Literal, NamedTuple

from server.relay.browser import Browser
from server.relay.hub_events import SeparationLost
from server.relay.live_drone import LiveDrone
from server.relay.live_messages import Separation
from server.relay.live_state import LiveState
from server.separation.bounds import STALE_S, Level, SeparationBounds
from server.separation.encounter import Encounter
from server.separation.motion import Motion, Relative, motion_in
from server.separation.watch import SeparationWatch, Sky
from wire.ids import DroneId

AGAIN_S: Final = 2.0
"""The figures of an alert that lasts are told anew so often."""
MOST_AGAIN: Final = 50
"""Of the worst ones. The others keep the figures of their last change."""

_WORDS: Final[dict[Level, Literal["caution", "warning", "clear"]]] = {
    Level.CLEAR: "clear",
    Level.CAUTION: "caution",
    Level.WARNING: "warning",
}


class Counts(NamedTuple):
    """Pairs in alert; and how often, since the start, there was more than the watch looks at."""

    cautions: int
    warnings: int
    cut_short: int


class SeparationTelling:
    """Plain calls only, like all of the hub."""

    def __init__(self, state: LiveState, bounds: SeparationBounds) -> None:
        self._state = state
        self._watch = SeparationWatch(Sky(self._flying, self._motion), bounds)
        self._again_at = float("-inf")

    def tick(self, now: float) -> None:
        """Some ten times a second."""
        for one in self._watch.tick(now):
            self._state.traffic.separation[_WORDS[one.level]] += 1
            self._tell(one)
            if one.level is Level.WARNING and one.judged is not None:
                _, in_s, horizontal_m, vertical_m = one.judged.approach
                self._state.on_event(SeparationLost(*one.pair, in_s, horizontal_m, vertical_m))
        if now - self._again_at >= AGAIN_S:
            self._again_at = now
            for one in self._watch.encounters[:MOST_AGAIN]:
                self._tell(one)

    def tell_all(self, browser: Browser) -> None:
        """What holds now, to somebody who has just come."""
        for one in self._watch.encounters:
            self._tell(one, only=browser)

    def counts(self) -> Counts:
        """Of this moment."""
        levels = [one.level for one in self._watch.encounters]
        return Counts(levels.count(Level.CAUTION), levels.count(Level.WARNING), self._watch.cut_short)

    def _flying(self, now: float) -> dict[DroneId, Motion]:
        flying = {}
        for drone_id, drone in self._state.drones.items():
            if drone.airborne and drone.position_frame is not None and now - drone.position_at <= STALE_S:
                motion = motion_in(drone.position_frame, drone.position_at)
                if motion is not None:
                    flying[drone_id] = motion
        return flying

    def _motion(self, drone_id: DroneId) -> Motion | None:
        drone = self._state.drones.get(drone_id)
        if drone is None or drone.position_frame is None:
            return None
        # While nobody hears it, its last place is what is known of it: it did not land because its link broke.
        if drone.link is not None and drone.autopilot_heard and not drone.airborne:
            return None
        return motion_in(drone.position_frame, drone.position_at)

    def _tell(self, one: Encounter, *, only: Browser | None = None) -> None:
        first, second = one.pair
        sees_first, sees_second = self._watchers(first), self._watchers(second)
        back = one.seen.seen_back() if one.seen is not None else None
        both = _event(one, (first, second), one.seen)
        only_first, only_second = _event(one, (first, None), one.seen), _event(one, (second, None), back)
        for number, browser in (sees_first | sees_second).items():
            if only is not None and browser is not only:
                continue
            if number in sees_first:
                browser.tell(both if number in sees_second else only_first)
            else:
                browser.tell(only_second)

    def _watchers(self, drone_id: DroneId) -> dict[int, Browser]:
        drone: LiveDrone | None = self._state.drones.get(drone_id)
        return {browser.number: browser for browser in drone.frame_watchers()} if drone is not None else {}


def _event(one: Encounter, drones: tuple[int, int | None], seen: Relative | None) -> Separation:
    approach = one.judged.approach if one.judged is not None else None
    return Separation(
        number=one.number,
        level=_WORDS[one.level],
        drones=drones,
        in_s=round(approach.in_s, 1) if approach else None,
        horizontal_m=round(approach.horizontal_m, 1) if approach else None,
        vertical_m=round(approach.vertical_m, 1) if approach else None,
        bearing_deg=round(seen.bearing_deg) % 360 if seen else None,
        distance_m=round(seen.distance_m, 1) if seen else None,
        above_m=round(seen.up_m, 1) if seen else None,
        why=one.over,
    )
