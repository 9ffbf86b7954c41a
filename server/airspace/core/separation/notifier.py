"""Notifies people about drones that come close: all who get the frames of either one. Part of the hub.

A person who may see both drones gets everything. A person who may not see the other one gets what `strangers` allows:
that there is another drone, and roughly where, enough to keep away and nothing else about the other squad.

With several towers each pair is told of once: see `drones_in_air`.
"""

import secrets
from collections.abc import Callable, Iterator
from typing import Final, Literal, NamedTuple

from server.airspace.core.separation.bounds import Level, SeparationBounds
from server.airspace.core.separation.drones_in_air import DronesInAir
from server.airspace.core.separation.encounter import Encounter
from server.airspace.core.separation.motion import Relative, boot_s_in, motion_in
from server.airspace.core.separation.strangers import Rounded, StrangerAlert, StrangerAlerts, rounded
from server.airspace.core.separation.watch import AirPicture, SeparationWatch
from server.live.browser import Browser
from server.live.hub_events import MotionSuspected, SeparationLost
from server.live.live_drone import LiveDrone
from server.live.live_messages import Separation
from server.live.live_state import LiveState
from wire.ids import DroneId

AGAIN_S: Final = 2.0
"""How often the figures of a lasting alert are sent again."""
MAX_REPEATED: Final = 50
"""For the worst alerts. The others keep the figures of their last change."""
MOTION_S: Final = 0.5
"""How often it is looked whether a drone moves as it can: a fifth of them at each tick."""
_PARTS: Final = 5

_WORDS: Final[dict[Level, Literal["caution", "warning", "clear"]]] = {
    Level.CLEAR: "clear",
    Level.CAUTION: "caution",
    Level.WARNING: "warning",
}


def random_number() -> int:
    """Small enough for JavaScript."""
    return secrets.randbits(48)


class Counts(NamedTuple):
    """Pairs in alert, and how often the watch had more pairs than it can check."""

    cautions: int
    warnings: int
    cut_short: int


class SeparationNotifier:
    """Plain calls only, like all of the hub."""

    def __init__(
        self, state: LiveState, bounds: SeparationBounds, new_number: Callable[[], int] = random_number
    ) -> None:
        self._state = state
        self.in_air = DronesInAir(state)
        """Also for the other towers."""
        picture = AirPicture(self.in_air.flying, self.in_air.motion, self.in_air.concerns)
        self._watch = SeparationWatch(picture, bounds, new_number)
        self._strangers = StrangerAlerts(new_number)
        self._heard: dict[int, set[int]] = {}
        """Browsers that got everything about an encounter, by its number."""
        self._again_at = float("-inf")
        self._motion_at = float("-inf")
        self._motion_part = 0

    def tick(self, now: float) -> None:
        """Some ten times a second."""
        self._check_motions(now)
        for one in self._watch.tick(now):
            self._notify(one, now)
            if not self.in_air.leads(one.pair):
                continue
            self._state.traffic.separation[_WORDS[one.level]] += 1
            if one.level is Level.WARNING and one.judged is not None:
                _, in_s, horizontal_m, vertical_m = one.judged.approach
                self._state.on_event(SeparationLost(*one.pair, in_s, horizontal_m, vertical_m))
        if now - self._again_at >= AGAIN_S:
            self._again_at = now
            encounters = self._watch.encounters
            for one in encounters[:MAX_REPEATED]:
                self._notify(one, now)
            for one in encounters[MAX_REPEATED:]:
                self._notify_strangers(one, now)  # one that is disarmed ends its alert
            self._strangers.forget_all_but(one.number for one in encounters)

    def send_all(self, browser: Browser) -> None:
        """The present alerts, for a new browser."""
        for one in self._watch.encounters:
            first, second = (browser.number in self._watchers(drone_id) for drone_id in one.pair)
            if first and second:
                if not self.in_air.leads(one.pair):
                    continue
                self._heard.setdefault(one.number, set()).add(browser.number)
                browser.notify(_event(one))
            elif first or second:
                own = one.pair[0 if first else 1]
                alert = self._strangers.last(one.number, own)
                if alert is not None:
                    browser.notify(_event_of_stranger(own, alert))

    @property
    def encounters(self) -> list[Encounter]:
        """The pairs in alert that this tower leads, the worst first."""
        return [one for one in self._watch.encounters if self.in_air.leads(one.pair)]

    def for_strangers(self) -> Iterator[tuple[DroneId, DroneId, Rounded]]:
        """The present alerts about hidden drones: the recipient's own drone, the other one, what may be said."""
        return self._strangers.present()

    def counts(self) -> Counts:
        """A snapshot of this moment."""
        levels = [one.level for one in self.encounters]
        return Counts(levels.count(Level.CAUTION), levels.count(Level.WARNING), self._watch.cut_short)

    # -- how drones move -------------------------------------------------------------------------------------

    def _check_motions(self, now: float) -> None:
        if not self._watch.bounds.horizontal_m or now - self._motion_at < MOTION_S / _PARTS:
            return
        self._motion_at = now
        self._motion_part = (self._motion_part + 1) % _PARTS
        for drone_id, drone in self._state.drones.items():
            if drone_id % _PARTS == self._motion_part:
                try:
                    self._check_motion(drone, now)
                except Exception as error:
                    self._state.on_fault("separation", drone_id, error)

    def _check_motion(self, drone: LiveDrone, now: float) -> None:
        frame = drone.position_frame
        if frame is None or drone.motion_check.is_settled(drone.position_at):
            return
        motion = motion_in(frame, drone.position_at)
        if motion is None:
            return
        if drone.motion_check.check(motion, boot_s_in(frame), now):
            self._state.publish_soon(drone)
            why = drone.motion_check.why
            if why is not None and drone.armed is not False:
                self._state.on_event(MotionSuspected(drone.drone_id, why))

    # -- notifier ---------------------------------------------------------------------------------------------

    def _notify(self, one: Encounter, now: float) -> None:
        first, second = (self._watchers(drone_id) for drone_id in one.pair)
        # Its leader tells of it; if that is another tower now, those who were told here hear its end.
        both = first.keys() & second.keys() if self.in_air.leads(one.pair) else set[int]()
        event = _event(one)
        for number in both:
            first[number].notify(event)
        for number in self._heard.pop(one.number, set()) - both:
            browser = self._state.browsers.get(number)
            if browser is not None:  # may see one of them no more: for them it is over
                browser.notify(_event_over(one))
        if not one.over:
            self._heard[one.number] = both
        self._notify_strangers(one, now)

    def _notify_strangers(self, one: Encounter, now: float) -> None:
        """Computed for each drone of the pair, with or without viewers: the content must not depend on who listens."""
        for drone_id in one.pair:
            if self.in_air.is_here(drone_id):
                self._check_motion(self._state.drones[drone_id], now)
        found = [self.in_air.is_credible(drone_id, now) for drone_id in one.pair]
        fit = False if False in found else None if None in found else True
        first, second = one.pair
        approach = one.judged.approach if one.judged is not None else None
        back = one.seen.seen_back() if one.seen is not None else None
        for own, other, seen in ((first, second, one.seen), (second, first, back)):

            def about(seen: Relative | None = seen) -> Rounded:
                return rounded(one.level, approach, seen)

            ours = fit if self.in_air.is_here(own) else False  # else its home tells
            alert = self._strangers.check(one.number, (own, other), one.level, about, qualifies=ours, now=now)
            if alert is not None:
                event = _event_of_stranger(own, alert)
                # A viewer who may now see the other drone knows more; the alert for strangers still needs its end.
                knowing = self._watchers(other) if alert.about.level is not Level.CLEAR else {}
                for number, browser in self._watchers(own).items():
                    if number not in knowing:
                        browser.notify(event)

    def _watchers(self, drone_id: DroneId) -> dict[int, Browser]:
        drone = self._state.drones.get(drone_id)
        if drone is None:
            return {}
        return {browser.number: browser for browser in self._state.frame_watchers_of(drone)}


def _event(one: Encounter) -> Separation:
    """For those who see both."""
    approach = one.judged.approach if one.judged is not None else None
    seen = one.seen
    return Separation(
        number=one.number,
        level=_WORDS[one.level],
        drones=one.pair,
        in_s=round(approach.in_s, 1) if approach else None,
        horizontal_m=round(approach.horizontal_m, 1) if approach else None,
        vertical_m=round(approach.vertical_m, 1) if approach else None,
        bearing_deg=round(seen.bearing_deg) % 360 if seen else None,
        distance_m=round(seen.distance_m, 1) if seen else None,
        above_m=round(seen.up_m, 1) if seen else None,
        why=one.over,
    )


def _event_over(one: Encounter) -> Separation:
    """For those who may no longer see both: nothing about why."""
    return Separation(one.number, "clear", one.pair, None, None, None, None, None, None, "")


def _event_of_stranger(own: DroneId, alert: StrangerAlert) -> Separation:
    level, in_s, bearing_deg, distance_m, above_m = alert.about
    return Separation(
        number=alert.number,
        level=_WORDS[level],
        drones=(own, None),
        in_s=in_s,
        horizontal_m=None,
        vertical_m=None,
        bearing_deg=bearing_deg,
        distance_m=distance_m,
        above_m=above_m,
        why="",
    )
