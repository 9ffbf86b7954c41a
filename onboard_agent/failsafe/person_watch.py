"""Measures how long nobody has flown a drone that holds or whose holder is gone. No I/O; takes `now`.

Rules, each tested:
- A hold restarts the count, because a person was present to cause it.
- Flying, by sticks or by a command that the autopilot shows, ends it.
- A missing holder starts it. A returning holder ends it, unless the drone holds: then they must fly or say "stay".
- A lease that expires while the holder is gone changes nothing. A released lease is no loss.
- "Stay" lasts until the next hold, or until somebody flies.
"""


class PersonWatch:
    """Report what people do; read `absent_s`."""

    def __init__(self) -> None:
        self.stayed = False
        self.stayed_by = ""
        self.holding = False
        """Whether a hold started the count."""
        self._since: float | None = None

    def hold_began(self, now: float) -> None:
        """The drone holds, for whatever reason."""
        self._since = now
        self.holding = True
        self.stayed = False

    def commanded(self, now: float) -> None:
        """Restarts a running count, because a person gave a command that does not end the hold."""
        if self._since is not None:
            self._since = now

    def attended(self) -> None:
        """Somebody flies the drone, or it is on the ground."""
        self._since = None
        self.holding = self.stayed = False

    def stay(self, by: str) -> None:
        """A person said "stay". Ignored if no count runs."""
        if self._since is not None:
            self.stayed, self.stayed_by = True, by

    def holder_reported(self, *, held: bool, present: bool, now: float) -> None:
        """The tower reports whether there is a holder and whether they are present."""
        if present and not self.holding:
            self.attended()
        elif held and not present and self._since is None:
            self._since = now

    def absent_s(self, now: float) -> float | None:
        """Seconds since the count started; None while somebody is present."""
        return None if self._since is None else now - self._since
