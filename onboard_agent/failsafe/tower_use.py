"""Whether the tower takes part in this flight. A drone that a radio pilot flies alone is not brought home. No I/O."""

from typing import Final

BEFORE_ARMING_S: Final = 10.0
"""Input from the tower this shortly before arming belongs to the flight, because it armed the drone."""


class TowerUse:
    """Call `used` for sticks and commands that pass, and `heartbeat` for every heartbeat; read `in_this_flight`."""

    def __init__(self) -> None:
        self._used_at: float | None = None
        self._armed = False
        self.in_this_flight = False

    def used(self, now: float) -> None:
        """Sticks or a flight command from the tower went to the autopilot, or the tower ordered a hold."""
        self._used_at = now
        if self._armed:
            self.in_this_flight = True

    def heartbeat(self, *, armed: bool, now: float) -> None:
        """A HEARTBEAT of the autopilot."""
        if armed and not self._armed:
            self.in_this_flight = self._used_at is not None and now - self._used_at <= BEFORE_ARMING_S
        elif not armed:
            self.in_this_flight = False
        self._armed = armed
