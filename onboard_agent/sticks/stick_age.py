"""Whether arriving sticks are too old for too long, so that the pilot sees their effect too late. No I/O.

The drone's limit covers the whole round trip; sticks get half of it. Age is the delay by the tower's timestamp
(wire.lateness) plus half the round trip of an idle link. The count starts when the sticks became too old on their way,
not when they arrive.
"""

from wire.control_messages import SafetySettings


class StickAge:
    """Call `came` for each stick frame that arrives, fresh or not; call `too_old` at each tick."""

    def __init__(self) -> None:
        self._since: float | None = None
        self.age_s = 0.0
        """Age of the last sticks."""

    def came(self, age_s: float, now: float, settings: SafetySettings) -> None:
        """Sticks of this age arrived."""
        self.age_s = age_s
        limit_s = settings.rtt_limit_ms / 2000.0
        if age_s <= limit_s:
            self._since = None
        elif self._since is None:
            self._since = now - (age_s - limit_s)

    def over(self) -> None:
        """Nobody flies by hand any more."""
        self._since = None

    def too_old(self, now: float, settings: SafetySettings) -> bool:
        """True once, when they have been too old for as long as the drone's settings allow."""
        if self._since is None or now - self._since < settings.rtt_limit_s:
            return False
        self._since = None
        return True
