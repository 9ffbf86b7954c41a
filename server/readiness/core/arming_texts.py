"""The reasons against arming that an autopilot gives in its STATUSTEXTs. Pure; takes `now`.

An autopilot that is not ready repeats its reasons every half minute or so while it is disarmed, and says nothing when
they end: a reason that was not repeated is over.
"""

from __future__ import annotations

import re
from typing import Final

REPEATED_WITHIN_S: Final = 45.0
"""ArduPilot repeats them every 30 s."""
MAX_REASONS: Final = 12
_REASON: Final = re.compile(r"^(?:PreArm|Arm|Preflight Fail|Arming denied)\s*[:!]\s*(.+)$", re.IGNORECASE)


class ArmingTexts:
    """Of one drone."""

    def __init__(self) -> None:
        self._said_at: dict[str, float] = {}

    def take(self, text: str, now: float) -> None:
        """Takes a whole text; keeps it if it is a reason against arming."""
        found = _REASON.match(text)
        if found is None:
            return
        reason = found[1].rstrip(". ")
        self._said_at.pop(reason, None)
        self._said_at[reason] = now
        while len(self._said_at) > MAX_REASONS:
            del self._said_at[next(iter(self._said_at))]

    def now(self, now: float) -> tuple[str, ...]:
        """The reasons that still hold, oldest first."""
        return tuple(reason for reason, at in self._said_at.items() if now - at <= REPEATED_WITHIN_S)

    def forget(self) -> None:
        """The link is gone, or the drone is armed: nothing bars it."""
        self._said_at.clear()
