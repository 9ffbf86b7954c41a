"""Alerts that a tower of several left behind when it ended for good: which of them are closed, and why. Pure.

A drone that comes to another tower takes its alerts along, and that tower judges them. What is left then is about a
drone that no tower hears, about a drone that was removed, or about the tower itself. It is closed with a reason,
because nobody will ever see that it is over, and only after a time in which no machine stays in the air.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

from server.towers.core.place import Place
from wire.ids import DroneId

GONE_FOR_S: Final = 12 * 3600.0
"""Longer than a flight: what a drone had in the air does not last any more. A tower under repair is back by then."""
REMOVED_FOR_S: Final = 600.0
"""The tower that has a removed drone closes its alerts itself, within seconds."""
LAST_UNHEARD: Final = frozenset({"link-lost", "link-lost-on-ground", "hold-unconfirmed"})
"""Rules whose condition lasts as long as no tower hears the drone."""
ON_HOLD: Final = "on-hold"


class OpenAlert(NamedTuple):
    """What is stored of an open alert. `drone_id`: None if it is about the tower `subject`."""

    id: int
    rule: str
    subject: str
    drone_id: DroneId | None


class LeftDrone(NamedTuple):
    """`was_heard`: by this tower since its start, or its agent is linked here. `on_hold`: its hold is open."""

    name: str
    place: Place
    was_heard: bool
    on_hold: bool


class Why(NamedTuple):
    """`words`: for people. `after_s`: for how long it must be so."""

    words: str
    after_s: float


def why_left(alert: OpenAlert, drone: LeftDrone | None, towers: frozenset[str] | None, *, is_first: bool) -> Why | None:
    """Why nobody will see the end of an alert; None if some tower will. `drone`: None if there is none any more.
    `towers`: the subjects of all running towers' own alerts, None if one of them is not known. `is_first`: of the
    running towers this one closes what belongs to none of them."""
    hours = round(GONE_FOR_S / 3600)
    if alert.drone_id is None:
        is_gone = is_first and towers is not None and alert.subject not in towers
        return Why(f"The tower that it is about has been gone for {hours} hours.", GONE_FOR_S) if is_gone else None
    if drone is None:
        return Why("The drone was removed.", REMOVED_FOR_S) if is_first else None
    if drone.was_heard or alert.rule in LAST_UNHEARD or (alert.rule == ON_HOLD and drone.on_hold):
        return None
    if drone.place is Place.HERE or (drone.place is Place.NOWHERE and is_first):
        words = f"The tower that saw it is gone, and no tower has heard {drone.name} for {hours} hours since."
        return Why(words, GONE_FOR_S)
    return None


class LeftAlerts:
    """Since when each alert has been left. A restart of this tower counts anew."""

    def __init__(self) -> None:
        self._since: dict[int, float] = {}

    def due(self, left: Mapping[int, Why], now: float) -> dict[int, str]:
        """The alerts that are to be closed now, with the reason in words. `left`: all that are left now, by id; one
        that is missing has been found again, and counts anew. `now`: monotonic seconds."""
        self._since = {alert_id: self._since.get(alert_id, now) for alert_id in left}
        return {alert_id: why.words for alert_id, why in left.items() if now - self._since[alert_id] >= why.after_s}
