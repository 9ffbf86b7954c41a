"""The alerts of all drones: finds them by the table of rules, tells those who may know, takes acknowledgements.

Part of the hub: plain calls, no database, `now` passed in. A drone is looked at twice a second, a fifth of them at each
tick, so the path of a frame has no part in it. Whoever stores alerts is told of each change (`listeners`) and gives
those of before a restart back with `restore`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime
from typing import Final

from server.airspace.core.separation.notifier import SeparationNotifier, random_number
from server.alerts.core.alert import Alert
from server.alerts.core.facts_of import facts_of
from server.alerts.core.lasting import Change, Changed
from server.alerts.core.muting import is_muted
from server.alerts.core.pair_alerts import PairFound, PairKey, pairs_found
from server.alerts.core.refusals import MayNotAcknowledge, UnknownAlert
from server.alerts.core.rules import BY_NAME, MOTORS_STOPPED, NEAR, OF_TOWER, TOO_NEAR
from server.alerts.core.tower_facts import TowerFacts
from server.alerts.core.views import AlertView
from server.alerts.core.watched_drone import WatchedDrone
from server.kernel.access import AccessRequest, Action, judge
from server.kernel.people import Principal, UserRef
from server.kernel.relations import Right
from server.live.browser import Browser
from server.live.hub_events import MotorsStopped
from server.live.live_drone import LiveDrone
from server.live.live_messages import AlertChanged, Notice
from server.live.live_state import LiveState
from server.towers.core.place import Place
from wire.ids import DroneId

LOOK_S: Final = 0.5
"""How often the rules of one drone are evaluated."""
PARTS: Final = 5
MAX_AWAITING: Final = 20
"""Alerts of one drone that are over and wait for a person. Beyond it the oldest goes: the history has it."""
_PAIRS: Final = frozenset({NEAR.name, TOO_NEAR.name})
Listener = Callable[[Alert], None]


def knows_of_tower(viewer: Principal) -> bool:
    """Whether this user is told of alerts of the tower itself."""
    return judge(AccessRequest(viewer, Action.ADMINISTER)).allowed


class AlertService:
    """One for the hub."""

    def __init__(
        self,
        state: LiveState,
        separation: SeparationNotifier,
        height_limit_m: float = 0.0,
        new_id: Callable[[], int] = random_number,
    ) -> None:
        self._state = state
        self._separation = separation
        self._height_limit_m = height_limit_m
        self._new_id = new_id
        self._drones: dict[DroneId, WatchedDrone] = {}
        self._tower = WatchedDrone()
        """What is wrong with the tower itself."""
        self.tower_facts = TowerFacts()
        """As measured last, by whoever measures it."""
        self.tower = ""
        """Which of several towers this is: the subject of its own alerts."""
        self._pairs: dict[PairKey, Alert] = {}
        self._live: dict[int, Alert] = {}
        """Every alert that is open or waits for a person, by id."""
        self._looked_at = float("-inf")
        self._part = 0
        self.opened: Counter[str] = Counter()
        """How many were opened since the start, by severity."""
        self.listeners: list[Listener] = []
        """Called after each change with the alert as it is now: whoever stores alerts, or tells people elsewhere. They
        must return at once."""
        self.are_taken_over: Callable[[DroneId], bool] = lambda drone_id: False
        """Whether the other tower that has the drone now goes on with its alerts."""
        self.on_handed_over: Listener = lambda alert: None
        """Another tower goes on with this alert: here it is forgotten."""

    # -- reading ---------------------------------------------------------------------------------------------

    def counts(self) -> Counter[str]:
        """How many are open, by severity."""
        return Counter(str(one.rule.severity) for one in self._live.values() if one.closed_at is None)

    def visible(self, viewer: Principal) -> Iterator[Alert]:
        """The alerts that are open or wait for a person, as far as this user may know of them."""
        # Most alerts are of drones of strangers: those are looked at once for each drone, not for each alert.
        gets_frames: dict[DroneId | None, bool] = {None: True}
        for alert in self._live.values():
            if alert.drone_id not in gets_frames:
                gets_frames[alert.drone_id] = self._gets_frames(self._drone(alert), viewer)
            if gets_frames[alert.drone_id] and self._knows(viewer, alert):
                yield alert

    def live(self) -> list[Alert]:
        """Every alert that is open or waits for a person, whoever may know of it."""
        return list(self._live.values())

    def has(self, alert_id: int) -> bool:
        """Whether this tower has it in the present picture."""
        return alert_id in self._live

    def acknowledgement_of(self, alert_id: int) -> datetime | None:
        """When an alert of the present picture was acknowledged."""
        alert = self._live.get(alert_id)
        return alert.acknowledged_at if alert is not None else None

    def may_know(
        self,
        viewer: Principal,
        drone_id: DroneId | None,
        other_id: DroneId | None,
        *,
        about_stranger: bool,
        at: datetime,
    ) -> bool:
        """Whether this user may know of an alert that was opened at that time."""
        if drone_id is None:
            return knows_of_tower(viewer)
        if not self._sees(drone_id, viewer, at):
            return False
        return other_id is None or self._sees(other_id, viewer, at) != about_stranger

    def welcome(self, browser: Browser) -> list[AlertView]:
        """What a new browser is told first."""
        seen = list(self.visible(browser.viewer))
        for alert in seen:
            alert.told.add(browser.number)
        return [AlertView.of(alert) for alert in seen]

    # -- a person --------------------------------------------------------------------------------------------

    def acknowledge(self, alert_id: int, viewer: Principal) -> Alert:
        """This user has seen to it. Repeated: nothing changes. Raises UnknownAlert, MayNotAcknowledge."""
        alert = self._live.get(alert_id)
        if alert is None or not self._may_know(viewer, alert):
            raise UnknownAlert
        drone = self._drone(alert)
        if drone is not None and not drone.may(viewer.user_id, viewer.role, Right.ACKNOWLEDGE):
            raise MayNotAcknowledge(drone.record.name)
        if alert.acknowledged_at is None:
            alert.acknowledged_at, alert.acknowledged_by = self._state.clock(), UserRef(viewer.user_id, viewer.name)
            self._changed(alert)
        return alert

    # -- start -----------------------------------------------------------------------------------------------

    def restore(self, alerts: Iterable[Alert], now: float) -> None:
        """Alerts of before a restart. Those of pairs end: who is near whom is found again within seconds."""
        for alert in alerts:
            watched = self._restored_in(alert)
            if watched is None or (alert.closed_at is None and alert.rule.name in _PAIRS):
                alert.closed_at = alert.closed_at or self._state.clock()
                self._notify_listeners(alert)
            if watched is None or not alert.is_live or alert.id in self._live:
                continue
            self._live[alert.id] = alert
            if alert.closed_at is None and alert.key in watched.open:
                self._close(alert)  # it has been found again meanwhile
                continue
            watched.add(alert)
            if alert.closed_at is not None:
                continue
            watched.restore(alert, now)

    def end(self, alert_id: int, why: str) -> None:
        """Nobody will see that it is over. Harmless for one that is."""
        alert = self._live.get(alert_id)
        watched = None if alert is None or alert.closed_at is not None else self._watched_by(alert)
        if alert is not None and watched is not None:
            watched.forget(alert)
            alert.closed_why = why
            self._close(alert)

    # -- time ------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Some ten times a second."""
        if now - self._looked_at < LOOK_S / PARTS:
            return
        self._looked_at = now
        self._part = (self._part + 1) % PARTS
        for drone_id, drone in self._state.drones.items():
            if drone_id % PARTS == self._part:
                try:
                    self._look(drone, now)
                except Exception as error:
                    self._state.on_fault("alerts", drone_id, error)
        if self._part == 0:
            self._look_at_tower(now)
            self._look_at_pairs()
            self._forget_removed()
            self._tell_newcomers()

    def _look_at_tower(self, now: float) -> None:
        lasting, at = self._tower.lasting, self._state.clock()
        for rule, condition in OF_TOWER:
            is_open = (rule.name, self.tower) in lasting.open
            changed = lasting.take(rule, self.tower, condition(self.tower_facts, at, is_open), now)
            if changed is not None:
                self._apply(self._tower, None, changed)

    def _look(self, drone: LiveDrone, now: float) -> None:
        watched = self._watched(drone)
        if drone.place in (Place.ELSEWHERE, Place.OUT_OF_REACH):
            if not watched.blank:
                self._leave(watched, drone)
            return
        if not drone.last_heard.ever:
            return  # nothing is known of it since the start: what was open stays open
        if not watched.needs_look(drone):
            return
        facts = facts_of(drone, self._height_limit_m, now)
        for changed in watched.conditions_found(facts, now):
            self._apply(watched, drone.drone_id, changed)
        for changed in watched.texts_found(drone, facts, now):
            self._apply(watched, drone.drone_id, changed)

    def _leave(self, watched: WatchedDrone, drone: LiveDrone) -> None:
        """Another tower is its home now, and judges it."""
        if self.are_taken_over(drone.drone_id):
            for alert in list(watched.alerts()):
                self._live.pop(alert.id, None)
                watched.drop(alert)
                self.on_handed_over(alert)
        elif drone.place is Place.ELSEWHERE:
            for alert in list(watched.open.values()):
                self._close(alert)  # its home finds it again
        watched.forget_conditions()

    def _apply(self, watched: WatchedDrone, drone_id: DroneId | None, changed: Changed) -> None:
        if changed.change is Change.OPENED:
            rule_name, subject = changed.key
            alert = Alert(
                id=self._new_id(),
                rule=BY_NAME[rule_name],
                subject=subject,
                drone_id=drone_id,
                words=changed.words,
                opened_at=self._state.clock(),
            )
            watched.add(alert)
            self._open(alert)
            if alert.rule is MOTORS_STOPPED and drone_id is not None:
                self._motors_stopped(self._state.drones[drone_id], alert)
            return
        known = watched.open.get(changed.key)
        if known is None:
            return
        if changed.change is Change.REWORDED:
            known.words = changed.words
            self._changed(known)
        else:
            self._close(known)

    def _motors_stopped(self, drone: LiveDrone, alert: Alert) -> None:
        self._state.on_event(MotorsStopped(drone.drone_id, drone.fall_watch.stopped))
        told = Notice("error", alert.rule.name, alert.words, drone.drone_id, 1)
        self._state.notify_watchers(drone, told)

    def _look_at_pairs(self) -> None:
        encounters, strangers = self._separation.encounters, list(self._separation.for_strangers())
        if not encounters and not strangers and not self._pairs:
            return
        names = {drone_id: drone.record.name for drone_id, drone in self._state.drones.items()}
        open_rules = {key: alert.rule.name for key, alert in self._pairs.items()}
        found = pairs_found(encounters, strangers, open_rules, names)
        for key, alert in list(self._pairs.items()):
            if key not in found or found[key].rule is not alert.rule:
                del self._pairs[key]
                self._close(alert)
        for key, one in found.items():
            if key not in self._pairs:
                self._open_pair(key, one)

    def _open_pair(self, key: PairKey, found: PairFound) -> None:
        alert = self._pairs[key] = Alert(
            id=self._new_id(),
            rule=found.rule,
            subject=f"{key.drone_id}/{key.other_id}",
            drone_id=key.drone_id,
            words=found.words,
            opened_at=self._state.clock(),
            other_id=key.other_id,
            about_stranger=key.about_stranger,
        )
        self._open(alert)

    def _forget_removed(self) -> None:
        gone = [drone_id for drone_id in self._drones if drone_id not in self._state.drones]
        for drone_id in gone:
            for alert in list(self._drones.pop(drone_id).alerts()):
                self._live.pop(alert.id, None)
                if alert.closed_at is None:
                    alert.closed_at = self._state.clock()
                    self._notify_listeners(alert)

    def _tell_newcomers(self) -> None:
        """Browsers that may see a drone since a moment ago, through an owner, a team or a loan."""
        for alert in self._live.values():
            drone = self._drone(alert)
            if drone is None and alert.drone_id is not None:
                continue
            watchers = self._state.browsers if drone is None else drone.watchers
            is_plain = drone is not None and alert.other_id is None and drone.user_without_view is None
            if is_plain and watchers.keys() == alert.told:
                continue  # nearly all of them, nearly every time
            alert.told &= self._numbers(alert)
            event: AlertChanged | None = None
            for number, browser in watchers.items():
                if number not in alert.told and self._knows(browser.viewer, alert):
                    event = event or AlertChanged(AlertView.of(alert))
                    alert.told.add(number)
                    browser.notify(event)

    # -- changes ---------------------------------------------------------------------------------------------

    def _open(self, alert: Alert) -> None:
        self._live[alert.id] = alert
        self.opened[str(alert.rule.severity)] += 1
        drone = self._drone(alert)
        if drone is not None:
            drone.noise.alerts += 1
        self._changed(alert)

    def _close(self, alert: Alert) -> None:
        alert.closed_at = self._state.clock()
        self._changed(alert)
        watched = self._watched_by(alert)
        if watched is not None:
            dropped = watched.closed(alert, MAX_AWAITING)
            if dropped is not None:
                self._live.pop(dropped.id, None)

    def _changed(self, alert: Alert) -> None:
        """Tells those who may know. The end is also told to those who were told of it, as long as they see the
        drone."""
        event = AlertChanged(AlertView.of(alert))
        for browser in self._watchers(alert):
            was_told = alert.closed_at is not None and browser.number in alert.told
            if was_told or self._knows(browser.viewer, alert):
                alert.told.add(browser.number)
                browser.notify(event)
        if not alert.is_live:
            self._live.pop(alert.id, None)
            watched = self._watched_by(alert)
            if watched is not None:
                watched.drop(alert)
        self._notify_listeners(alert)

    def _numbers(self, alert: Alert) -> set[int]:
        """Browsers that have not lost sight of its drones: the others have forgotten it."""
        if alert.drone_id is None:
            return set(self._state.browsers)
        numbers: set[int] | None = None
        for drone_id in (alert.drone_id, None if alert.about_stranger else alert.other_id):
            drone = self._state.drones.get(drone_id) if drone_id is not None else None
            if drone is not None:
                watching = {browser.number for browser in self._state.frame_watchers_of(drone)}
                numbers = watching if numbers is None else numbers & watching
        return numbers or set()

    def _notify_listeners(self, alert: Alert) -> None:
        for listener in self.listeners:
            listener(alert)

    # -- helpers ---------------------------------------------------------------------------------------------

    def _watched(self, drone: LiveDrone) -> WatchedDrone:
        watched = self._drones.get(drone.drone_id)
        if watched is None:
            watched = self._drones[drone.drone_id] = WatchedDrone()
        return watched

    def _drone(self, alert: Alert) -> LiveDrone | None:
        return None if alert.drone_id is None else self._state.drones.get(alert.drone_id)

    def _watched_by(self, alert: Alert) -> WatchedDrone | None:
        return self._tower if alert.drone_id is None else self._drones.get(alert.drone_id)

    def _restored_in(self, alert: Alert) -> WatchedDrone | None:
        """None: its drone is gone, or it is about a tower that does not exist any more."""
        if alert.drone_id is None:
            return self._tower if alert.subject == self.tower else None
        drone = self._state.drones.get(alert.drone_id)
        return None if drone is None else self._watched(drone)

    def _watchers(self, alert: Alert) -> Iterable[Browser]:
        """Among whom those are that may know of it."""
        if alert.drone_id is None:
            return list(self._state.browsers.values())
        drone = self._state.drones.get(alert.drone_id)
        return drone.frame_watchers() if drone is not None else ()

    def _knows(self, viewer: Principal, alert: Alert) -> bool:
        """Whether this user is told of it."""
        drone = self._drone(alert)
        if drone is not None and not drone.may_arm(viewer.user_id) and is_muted(drone, alert):
            return False
        return self._may_know(viewer, alert)

    def _may_know(self, viewer: Principal, alert: Alert) -> bool:
        about = alert.about_stranger
        return self.may_know(viewer, alert.drone_id, alert.other_id, about_stranger=about, at=alert.opened_at)

    def _sees(self, drone_id: DroneId, viewer: Principal, at: datetime) -> bool:
        """Whether this user gets the frames of the drone now, and may know what happened to it at that time."""
        drone = self._state.drones.get(drone_id)
        if drone is None:
            return False
        return self._gets_frames(drone, viewer) and drone.knows_of(viewer.user_id, viewer.role, at)

    @staticmethod
    def _gets_frames(drone: LiveDrone | None, viewer: Principal) -> bool:
        user_id = viewer.user_id
        return drone is not None and user_id != drone.user_without_view and drone.may(user_id, viewer.role, Right.SEE)
