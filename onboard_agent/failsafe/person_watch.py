"""Measures how long nobody has flown a drone in the air, whatever the cause. No I/O; takes `now`.

Rules, each tested:
- A hold restarts the count, because a person was present to cause it.
- Flying, by sticks or by a command that the autopilot shows, ends it.
- A missing holder starts it. A returning holder ends it, unless the drone holds: then they must fly or say "stay".
- A drone without a holder counts while it needs somebody: in the air, and not started to fly alone. A lease that
  expires while the holder is gone does not restart the count.
- "Stay" lasts for STAY_FOR_S, until the next hold, or until somebody flies. Then the count starts again.
"""

from typing import Final

STAY_FOR_S: Final = 600.0
"""A choice of somebody who looks at the drone: who still does renews it."""


class PersonWatch:
    """Report what people do; read `absent_s`."""

    def __init__(self) -> None:
        self.stayed = False
        self.stayed_by = ""
        self.holding = False
        """Whether a hold started the count."""
        self._since: float | None = None
        self._held = False
        self._is_unheld = False
        """Whether the count started because nobody has the controls."""
        self._stayed_at = 0.0

    def seen(self, now: float, *, needs_somebody: bool) -> None:
        """Call it at each tick. `needs_somebody`: in the air by the tower's doing, and neither flown by hand, nor on a
        mission that was started to fly alone, nor on its way home."""
        if self.stayed and now - self._stayed_at >= STAY_FOR_S:
            self.stayed, self._since = False, now
        if needs_somebody and not self._held and self._since is None:
            self._since, self._is_unheld = now, True
        elif self._is_unheld and not needs_somebody:
            self.attended()

    def hold_began(self, now: float) -> None:
        """The drone holds, for whatever reason."""
        self._since = now
        self.holding = True
        self.stayed = self._is_unheld = False

    def commanded(self, now: float) -> None:
        """Restarts a running count, because a person gave a command that does not end the hold."""
        if self._since is not None:
            self._since = now

    def attended(self) -> None:
        """Somebody flies the drone, or it is on the ground."""
        self._since = None
        self.holding = self.stayed = self._is_unheld = False

    def stay(self, by: str, now: float) -> None:
        """A person said "stay". Ignored if no count runs."""
        if self._since is not None:
            self.stayed, self.stayed_by, self._stayed_at = True, by, now

    def holder_reported(self, *, held: bool, present: bool, now: float) -> None:
        """The tower reports whether there is a holder and whether they are present."""
        self._held = held
        if present and not self.holding:
            self.attended()
        elif held and not present and self._since is None:
            self._since = now

    def absent_s(self, now: float) -> float | None:
        """Seconds since the count started; None while somebody is present."""
        return None if self._since is None else now - self._since
