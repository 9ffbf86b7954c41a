"""Whether sticks have been too old for too long: then the pilot no longer sees their effect. No I/O.

The drone's limit is for the whole round trip; half of it is for the sticks. Age is the delay by the tower's stamp
(wire.lateness) plus half the round trip of an idle link. Late sticks were late before they arrived: the count begins
when they became too old on their way.
"""

from wire.control_messages import SafetySettings


class StickAge:
    """Tell it of each stick frame that comes, fresh enough or not; ask `too_old` at each tick."""

    def __init__(self) -> None:
        self._since: float | None = None
        self.age_s = 0.0
        """Of the last sticks."""

    def came(self, age_s: float, now: float, settings: SafetySettings) -> None:
        """Sticks of this age came."""
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
