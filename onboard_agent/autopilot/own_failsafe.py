"""Whether the autopilot's own failsafe has chosen the flight mode, and why. No I/O; takes `now`.

PX4's failsafe shows AUTO.LOITER, as does a pilot's command, and returns or lands some seconds later. Only
`system_status` in the heartbeat tells them apart. The reason is in an EVENT, which arrives up to a heartbeat before.
"""

from typing import Any, Final

from wire.autopilots import registry
from wire.autopilots.failsafe_words import NOT_TOLD, Failsafe, FailsafeCause
from wire.autopilots.profile import AutopilotFamily
from wire.dialect import mavlink

SAME_WITHIN_S: Final = 2.0
"""An event this much older than the first heartbeat that shows the failsafe belongs to it."""

_ARMED: Final = 0x80


class OwnFailsafe:
    """Feed it heartbeats and EVENT frames of the autopilot."""

    def __init__(self) -> None:
        self.active = False
        self._family: AutopilotFamily | None = None
        self._told: Failsafe | None = None
        self._told_at = 0.0

    def heartbeat(self, message: Any, now: float) -> None:
        """A HEARTBEAT of the autopilot."""
        self._family = registry.FAMILIES.get(message.autopilot)
        shows = self._family is not None and self._family.shows_failsafe and bool(message.base_mode & _ARMED)
        was, self.active = self.active, shows and message.system_status == mavlink.MAV_STATE_CRITICAL
        if (was and not self.active) or (self.active and not was and now - self._told_at > SAME_WITHIN_S):
            self._told = None

    def event(self, frame: bytes, now: float) -> None:
        """An EVENT frame of the autopilot."""
        failsafe = None if self._family is None else self._family.read_failsafe(frame)
        if failsafe is not None:
            self._told, self._told_at = failsafe, now

    @property
    def misses_sticks(self) -> bool:
        """Whether it acts because no sticks arrive."""
        return self.active and self._told is not None and self._told.cause is FailsafeCause.MANUAL_CONTROL_LOSS

    @property
    def words(self) -> str:
        """What it does and why, for a pilot; empty if it does nothing."""
        if not self.active:
            return ""
        return NOT_TOLD if self._told is None else self._told.words
