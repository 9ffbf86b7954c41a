"""One alert: a condition that lasts, from its beginning to its end, and who acknowledged it."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime

from server.alerts.core.lasting import Key
from server.alerts.core.rules import Rule
from server.alerts.core.severity import Severity
from server.kernel.people import UserRef
from wire.ids import DroneId


@dataclass(slots=True)
class Alert:
    """Mutable; touched by the alert service only. `drone_id`: None if it is about the tower itself, which only admins
    know of; `subject` is then the tower. `other_id`: the second drone of a pair.

    `about_stranger`: the second drone is hidden from those who are told: nothing here names it, and whoever may see
    both drones gets another alert, with both names.
    """

    id: int
    rule: Rule
    subject: str
    drone_id: DroneId | None
    words: str
    opened_at: datetime
    other_id: DroneId | None = None
    about_stranger: bool = False
    acknowledged_at: datetime | None = None
    acknowledged_by: UserRef | None = None
    closed_at: datetime | None = None
    closed_why: str = ""
    """Why it was closed though nobody saw that it is over; empty: it is over."""
    told: set[int] = field(default_factory=set)
    """Browsers that know of it, by their number."""

    @property
    def key(self) -> Key:
        return self.rule.name, self.subject

    @property
    def needs_somebody(self) -> bool:
        """Whether a person has to see to it: while it lasts, and after that if it was critical."""
        if self.acknowledged_at is not None or self.rule.severity is Severity.NOTICE:
            return False
        return self.closed_at is None or self.rule.severity is Severity.CRITICAL

    @property
    def is_live(self) -> bool:
        """Whether it belongs to the present picture."""
        return self.closed_at is None or self.needs_somebody
