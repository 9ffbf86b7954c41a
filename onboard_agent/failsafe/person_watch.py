"""For how long nobody has flown a drone that is made to hold, or whose holder is gone. No I/O; takes `now`.

Laws, each with a test:
- A hold begins the count again: whoever made it hold was there.
- Whoever flies, by sticks or by a command that the autopilot shows, ends it.
- A holder who is gone begins it; one who is back ends it, unless the drone holds: then they must fly or say "stay".
- A lease that ends while the holder is gone changes nothing. One that is released is no loss.
- "Stay" lasts until the next hold, or until somebody flies.
"""


class PersonWatch:
    """Ask `gone_s`."""

    def __init__(self) -> None:
        self.stayed = False
        self.stayed_by = ""
        self.holding = False
        """The count is that of a hold."""
        self._since: float | None = None

    def hold_began(self, now: float) -> None:
        """The drone holds, whoever wanted it."""
        self._since = now
        self.holding = True
        self.stayed = False

    def acted(self, now: float) -> None:
        """Somebody commanded something that does not end the hold."""
        if self._since is not None:
            self._since = now

    def flown(self) -> None:
        """Somebody flies it, or it is on the ground."""
        self._since = None
        self.holding = self.stayed = False

    def stay(self, by: str) -> None:
        """Somebody said so. Without a count it says nothing."""
        if self._since is not None:
            self.stayed, self.stayed_by = True, by

    def holder(self, *, held: bool, present: bool, now: float) -> None:
        """The tower says who has the controls."""
        if present and not self.holding:
            self.flown()
        elif held and not present and self._since is None:
            self._since = now

    def gone_s(self, now: float) -> float | None:
        """Seconds; None while somebody is there."""
        return None if self._since is None else now - self._since
