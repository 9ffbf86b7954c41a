"""The pilot's signature under a preflight checklist, as the live state keeps it until the flight is over. No I/O."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any, Final

from server.kernel.people import UserRef

VALID_FOR: Final = timedelta(hours=1)


@dataclass(frozen=True)
class SignedLine:
    """A line as it stood when it was signed."""

    text: str
    state: str


@dataclass(frozen=True)
class Signature:
    """`flown`: the drone was armed since. Then it ends when the drone is disarmed."""

    by: UserRef
    at: datetime
    lines: tuple[SignedLine, ...]
    weather: str = ""
    flown: bool = False

    def is_valid(self, now: datetime) -> bool:
        """Whether it still counts for the next take-off, or for the flight that is going on."""
        return self.flown or self.at <= now < self.at + VALID_FOR

    def about(self) -> dict[str, Any]:
        """For the index of a flight and the audit trail."""
        return {
            "by": {"id": self.by.id, "name": self.by.name},
            "signed_at": self.at.isoformat(),
            "lines": [[line.text, line.state] for line in self.lines],
            "weather": self.weather,
        }


def after_report(signature: Signature | None, *, armed: bool | None) -> Signature | None:
    """The signature after the autopilot reported whether it is armed. One flight uses one signature."""
    if signature is None or armed is None:
        return signature
    if armed:
        return replace(signature, flown=True)
    return None if signature.flown else signature
