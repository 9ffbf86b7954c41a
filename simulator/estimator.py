"""Whether the vehicle knows its position: boot, GPS loss, and the seconds of dead reckoning.

While the position is known, the estimate equals the truth: sensor errors are not modelled.
"""

from __future__ import annotations

DEAD_RECKONING_S = 6.0
"""The position remains valid for this long after the loss of GPS (measured on ArduCopter 4.6.2)."""
ATTITUDE_SHARE = 0.3
FIX_SHARE = 0.6
"""When attitude and GPS fix become available, as shares of the boot time."""


class Estimator:
    def __init__(self, ready_s: float) -> None:
        self.ready_s = ready_s
        self._now_s = 0.0
        self._lost_since_s: float | None = None
        self._never = False

    def update(self, now_s: float, *, gps_lost: bool, never_ready: bool) -> None:
        self._now_s = now_s
        self._never = never_ready
        if not gps_lost:
            self._lost_since_s = None
        elif self._lost_since_s is None:
            self._lost_since_s = now_s

    @property
    def lost_for_s(self) -> float:
        """Seconds since the position was lost; 0 if it is known, or never was."""
        if self._lost_since_s is None or self.position_ok or self._lost_since_s < self.ready_s:
            return 0.0
        return self._now_s - self._lost_since_s - DEAD_RECKONING_S

    @property
    def attitude_ok(self) -> bool:
        return self._now_s >= ATTITUDE_SHARE * self.ready_s

    @property
    def gps_fix(self) -> bool:
        return self._now_s >= FIX_SHARE * self.ready_s and self._lost_since_s is None

    @property
    def position_ok(self) -> bool:
        if self._never or self._now_s < self.ready_s:
            return False
        return self._lost_since_s is None or self._now_s - self._lost_since_s < DEAD_RECKONING_S
