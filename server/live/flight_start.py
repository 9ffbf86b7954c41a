"""Since when a drone is in the air, as far as the tower knows. Takes the time of day; reads no clock."""

from dataclasses import dataclass
from datetime import datetime


@dataclass
class FlightStart:
    """Start of a drone's flight, from its agent's reports.

    Known only if this tower saw the drone on the ground first: a drone that is in the air when its agent connects may
    have been there for long. A link that is lost and restored in flight changes nothing.
    """

    since: datetime | None = None
    _was_on_ground: bool = False

    def report(self, *, heard: bool, airborne: bool, at: datetime | None) -> None:
        """The agent reports whether the drone is in the air. `at`: None if the time of day is not known."""
        if not heard:
            self.lost()
            return
        if not airborne:
            self.since = None
        elif self._was_on_ground:
            self.since = at
        self._was_on_ground = not airborne

    def lost(self) -> None:
        """The agent is gone or receives no heartbeats: a take-off meanwhile goes unnoticed."""
        self._was_on_ground = False
