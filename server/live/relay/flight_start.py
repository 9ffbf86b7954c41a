"""Since when a drone is in the air, as far as the tower knows. Takes the time of day; reads no clock."""

from dataclasses import dataclass
from datetime import datetime


@dataclass
class FlightStart:
    """Of one drone, from its agent's reports.

    Known only where the agent was heard on the ground first, by this tower: a drone that is in the air when
    its agent comes may have been there for long. A link that is lost and comes back in flight changes nothing.
    """

    since: datetime | None = None
    _was_on_ground: bool = False

    def report(self, *, heard: bool, airborne: bool, at: datetime | None) -> None:
        """The agent says whether it is in the air. `at` is None where nobody knows the time of day."""
        if not heard:
            self.lost()
            return
        if not airborne:
            self.since = None
        elif self._was_on_ground:
            self.since = at
        self._was_on_ground = not airborne

    def lost(self) -> None:
        """The agent is gone or hears no autopilot: whether the drone takes off meanwhile will not be known."""
        self._was_on_ground = False
