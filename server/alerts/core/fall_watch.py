"""Whether a multicopter falls or has crashed, from its position and attitude. Pure; takes `now`.

Judged by descent and height, not by armed and landed state: with all motors lost at 28 m ArduCopter reported itself
armed and in the air, the latter for 14 s on the ground; disarmed at 30 m it reported itself landed while it fell. So
motors that stop in the air are a drone disarmed while it was in the air, and that goes down: after a landing, the news
of the ground may come after that of the motors.
"""

from __future__ import annotations

import math
from struct import Struct
from typing import Final

from wire.frames import payload

FALLS_M_S: Final = 6.0
"""Autopilots descend by themselves at 1 to 3 m/s; a fall is this fast after 0.6 s."""
DIVES_M_S: Final = 15.0
"""What a hand on the sticks may want, where the mode leaves the height to it. Elsewhere sticks descend at some 5 m/s at
most: with one motor lost at 40 m and centred sticks, a copter in LOITER fell at up to 14 m/s (measured).
"""
SINKS_M_S: Final = 0.8
"""A hold keeps the height within a tenth of this."""
CLIMBS_M_S: Final = 0.5
LOOKS: Final = 2
"""One report may be an error of the estimate."""
ON_GROUND_M: Final = 3.0
TIPPED_RAD: Final = math.radians(65.0)
LEVEL_RAD: Final = math.radians(20.0)
TIPPED_FOR_S: Final = 1.0
STILL_M_S: Final = 1.0
DROPS_M_S: Final = 2.5
"""After a quarter of a second without motors."""
DROPS_M: Final = 1.5
DROPS_WITHIN_S: Final = 3.0

_POSITION: Final = Struct("<IiiiihhhH")
_ATTITUDE: Final = Struct("<Iff")


class FallWatch:
    """One for each drone. `falls`, `sinks`: how fast and where; `crashed`: how; empty: it does not, or has not."""

    def __init__(self) -> None:
        self.falls = ""
        self.sinks = ""
        """Whether that is wanted, the alert's rule judges."""
        self.crashed = ""
        self.stopped = ""
        """Where its motors stopped in the air, until they turn again."""
        self._flew = False
        self._disarmed_at: float | None = None
        self._disarmed_m = 0.0
        self._looks = self._sinking_looks = 0
        self._from_m = self._crashed_at_m = 0.0
        self._tipped_since: float | None = None
        self._position_at = float("-inf")
        self._was_disarmed = False

    def look(
        self,
        *,
        position: bytes | None,
        position_at: float,
        attitude: bytes | None,
        armed: bool | None,
        airborne: bool | None,
        may_dive: bool,
        now: float,
    ) -> None:
        """Takes the newest GLOBAL_POSITION_INT and when it came, and the newest ATTITUDE, as whole frames. `may_dive`:
        it is flown by hand, in a mode that leaves the height to the hand."""
        if position is None:
            return
        _, _, _, _, height_mm, north, east, down, _ = _POSITION.unpack_from(payload(position).ljust(28, b"\0"))
        height_m, down_m_s = height_mm / 1000, down / 100
        tilt = _tilt(attitude)
        still = math.hypot(north, east, down) / 100 < STILL_M_S
        if position_at != self._position_at:
            self._position_at = position_at
            self._sink(height_m, down_m_s)
            self._drop(height_m, down_m_s, armed, now)
            self._fall(height_m, down_m_s, DIVES_M_S if may_dive else FALLS_M_S, still=still)
        self._tip(armed, tilt, now, height_m, still=still)
        is_up = down_m_s < -CLIMBS_M_S and height_m > self._crashed_at_m + ON_GROUND_M  # a wreck bounces
        if armed and tilt < LEVEL_RAD and (self._was_disarmed or is_up) and not self.falls:
            self.crashed = ""  # it flies again
        self._was_disarmed = armed is False
        if armed:
            self._flew, self._disarmed_at, self.stopped = bool(airborne), None, ""

    def _drop(self, height_m: float, down_m_s: float, armed: bool | None, now: float) -> None:
        if armed is not False:
            return
        if self._flew:
            self._flew, self._disarmed_at, self._disarmed_m = False, now, height_m
        if self._disarmed_at is None:
            return
        if down_m_s >= DROPS_M_S or self._disarmed_m - height_m >= DROPS_M:
            self.stopped = f"{self._disarmed_m:.0f} m above home"
        if self.stopped or now - self._disarmed_at >= DROPS_WITHIN_S:
            self._disarmed_at = None

    def _sink(self, height_m: float, down_m_s: float) -> None:
        self._sinking_looks = self._sinking_looks + 1 if down_m_s >= SINKS_M_S else 0
        is_so = self._sinking_looks >= LOOKS and not self.falls
        self.sinks = f"{down_m_s:.1f} m/s, {height_m:.0f} m above home" if is_so else ""

    def _fall(self, height_m: float, down_m_s: float, limit_m_s: float, *, still: bool) -> None:
        if down_m_s >= limit_m_s:
            self._looks += 1
            if self._looks >= LOOKS:
                self.falls = f"{down_m_s:.0f} m/s, {height_m:.0f} m above home"
        elif self.falls and down_m_s > limit_m_s / 2:
            pass  # it slows down, and may not have come to an end
        else:
            # Rotors need longer to catch it: from one report to the next only the ground does, at whatever height.
            if self.falls and (still or height_m < ON_GROUND_M):
                self.crashed = f"it fell about {max(self._from_m - height_m, 0):.0f} m to the ground"
                self._crashed_at_m = height_m
            self.falls, self._looks, self._from_m = "", 0, height_m

    def _tip(self, armed: bool | None, tilt: float, now: float, height_m: float, *, still: bool) -> None:
        if not (armed and tilt > TIPPED_RAD and still):
            self._tipped_since = None
        elif self._tipped_since is None:
            self._tipped_since = now
        elif now - self._tipped_since >= TIPPED_FOR_S and not self.crashed:
            self.crashed = "it lies on its side with its motors armed"
            self._crashed_at_m = height_m


def _tilt(attitude: bytes | None) -> float:
    """Angle from level, radians; 0 if it is not known."""
    if attitude is None:
        return 0.0
    _, roll, pitch = _ATTITUDE.unpack_from(payload(attitude).ljust(12, b"\0"))
    if not (math.isfinite(roll) and math.isfinite(pitch)):
        return 0.0
    return math.acos(max(-1.0, min(1.0, math.cos(roll) * math.cos(pitch))))
