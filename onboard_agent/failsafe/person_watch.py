"""For how long nobody has flown a drone that holds, or whose holder is gone. No I/O; takes `now`.

Rules, each tested:

- A hold restarts the count: the person who ordered it was there.
- Flying, by sticks or by a command that the autopilot confirms, ends it.
- A missing holder begins it; a returning one ends it, unless the drone holds: then they must fly or say "stay".
- A lease that ends while the holder is gone changes nothing. A released lease is no loss.
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
        """The drone holds, for any cause."""
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
        """A person said "stay". Without a count it is ignored."""
        if self._since is not None:
            self.stayed, self.stayed_by = True, by

    def holder(self, *, held: bool, present: bool, now: float) -> None:
        """The tower reports who has the controls."""
        if present and not self.holding:
            self.flown()
        elif held and not present and self._since is None:
            self._since = now

    def gone_s(self, now: float) -> float | None:
        """Seconds; None while somebody is there."""
        return None if self._since is None else now - self._since
