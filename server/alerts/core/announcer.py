"""What is announced of alerts outside of the console: the beginning, the end, and that nobody has answered.

Part of the hub: plain calls, no database. Whoever delivers takes the announcements from here (`taken`); until then they
wait: those of each drone up to its share.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final

from server.alerts.core.alert import Alert
from server.alerts.core.muting import is_muted
from server.alerts.core.severity import Severity
from server.kernel.fair_queue import FairQueue
from server.kernel.shares import ShareName
from server.live.live_state import LiveState
from wire.ids import DroneId

RECENT: Final = timedelta(minutes=10)
"""After a restart the beginning of an older alert is no news."""
ON_THE_GROUND: Final = frozenset({"link-lost-on-ground", "hold-unconfirmed", "motion", "noisy-drone"})
"""Rules that are announced even if the drone is disarmed on the ground: somebody may stand beside it."""


class Happening(StrEnum):
    OPENED = "opened"
    CLOSED = "closed"
    UNANSWERED = "unanswered"
    """Critical, and nobody has acknowledged it in time: for admins."""


@dataclass(frozen=True, slots=True)
class Announcement:
    """`alert` goes on changing; the rest is as it was."""

    happening: Happening
    alert: Alert
    drone_name: str
    """Empty: it is about the tower itself."""


class Announcer:
    """One for the hub; a listener of the alert service."""

    def __init__(self, state: LiveState, *, unanswered_after_s: float) -> None:
        self._state = state
        self._unanswered_after = timedelta(seconds=unanswered_after_s) if unanswered_after_s else None
        self._announced: dict[int, Alert] = {}
        """Open alerts whose beginning was announced."""
        self._quiet: dict[int, Alert] = {}
        """Open alerts of drones on the bench: announced if the drone leaves it."""
        self._unanswered: set[int] = set()
        self._waiting: FairQueue[DroneId | None, Announcement] = FairQueue(0)
        """Of each drone; None: of the tower."""
        self.on_waiting: Callable[[], None] = lambda: None
        """Called when there is something to take."""

    def changed(self, alert: Alert) -> None:
        """An alert has opened, changed or closed."""
        if alert.closed_at is not None:
            self._quiet.pop(alert.id, None)
            if self._announced.pop(alert.id, None) is not None:
                self._unanswered.discard(alert.id)
                self._announce(Happening.CLOSED, alert)
        elif alert.id in self._announced:
            return
        elif self._is_worth_it(alert):
            self._quiet.pop(alert.id, None)
            self._announced[alert.id] = alert
            self._announce(Happening.OPENED, alert)
        else:
            self._quiet[alert.id] = alert

    def restored(self, alerts: Iterable[Alert], now: datetime) -> None:
        """Open alerts of before a restart: some may have opened just before it. Nobody gets the same one twice, and
        the end of an older one is news as well."""
        for alert in alerts:
            if alert.closed_at is not None:
                continue
            if now - alert.opened_at < RECENT:
                self.changed(alert)
            else:
                self._announced[alert.id] = alert

    def forget(self, alert: Alert) -> None:
        """Another tower goes on with it, and announces the rest."""
        self._quiet.pop(alert.id, None)
        self._announced.pop(alert.id, None)
        self._unanswered.discard(alert.id)

    def tick(self, now: datetime) -> None:
        """Every few seconds: finds what nobody has answered, and what is not on the bench any more."""
        for alert in list(self._quiet.values()):
            self.changed(alert)
        if self._unanswered_after is None:
            return
        for alert in self._announced.values():
            is_late = now - alert.opened_at >= self._unanswered_after
            if (
                is_late
                and alert.rule.severity is Severity.CRITICAL
                and alert.acknowledged_at is None
                and alert.id not in self._unanswered
            ):
                self._unanswered.add(alert.id)
                self._announce(Happening.UNANSWERED, alert)

    def waiting(self) -> dict[DroneId | None, int]:
        """How many wait of each drone; None: of the tower."""
        return self._waiting.all_waiting()

    def taken(self) -> list[Announcement]:
        """Returns what waits, oldest first of each drone, and forgets it."""
        return [self._waiting.pop()[1] for _ in range(len(self._waiting))]

    def give_back(self, announcements: list[Announcement]) -> None:
        """They could not be stored: they wait again, before all others."""
        for one in [*announcements, *self.taken()]:
            self._wait(one)

    def _is_worth_it(self, alert: Alert) -> bool:
        if alert.drone_id is None:
            return True
        drone = self._state.drones.get(alert.drone_id)
        if drone is None:
            return False
        if is_muted(drone, alert):
            return False
        is_on_the_bench = drone.armed is False and not drone.airborne
        return not is_on_the_bench or alert.rule.name in ON_THE_GROUND

    def _announce(self, happening: Happening, alert: Alert) -> None:
        name = ""
        if alert.drone_id is not None:
            drone = self._state.drones.get(alert.drone_id)
            if drone is None:
                return
            name = drone.record.name
        self._wait(Announcement(happening, alert, name))
        self.on_waiting()

    def _wait(self, announcement: Announcement) -> None:
        # The oldest go: the newest say how things are.
        self._waiting.share = self._state.shares.limit(ShareName.ANNOUNCEMENTS)
        self._waiting.put(announcement.alert.drone_id, announcement)
