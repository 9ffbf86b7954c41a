"""Whether a drone moves as a machine can, by its own reports. Pure; takes `now`.

A drone whose position jumps, or whose speed and position disagree, has lost its position or is invented. In both cases
only its own people get its alerts: it raises none with others for QUARANTINE_S.
"""

from math import cos, hypot, radians
from typing import Final, Literal, NamedTuple

from server.airspace.core.separation.motion import METRES_PER_DEGREE, Motion

Why = Literal["jump", "speed", "height", "course"]
"""`jump`: the position cannot be reached; `course`: the motion does not match the reported speed."""

FASTEST_M_S: Final = 120.0
"""Over ground. No drone that people fly from a console is faster."""
FASTEST_CLIMB_M_S: Final = 60.0
LOWEST_M: Final = -500.0
HIGHEST_M: Final = 9_000.0
"""Above the sea, as far as batteries and propellers go."""
COVERS_M_S: Final = 150.0
"""By the tower's clock, however the drone's own clock runs."""
LATE_S: Final = 2.0
"""A position may have been delayed by this much more than the one before."""
JUMP_M: Final = 50.0
"""A correction of the position filter, or a better fix, is less."""
COURSE_OVER_S: Final = 5.0
COURSE_OFF_M: Final = 30.0
COURSE_OFF_SHARE: Final = 0.5
"""Share of the distance that the speeds make over COURSE_OVER_S."""
CLOCK_AHEAD_S: Final = 3.0
CLOCK_FASTER: Final = 12.0
"""The drone's clock is used between two positions while it has not run further ahead of the tower's than this: a
simulator may fly faster than real time."""

QUARANTINE_S: Final = 60.0
KNOWN_FOR_S: Final = 10.0
"""Its positions must have been plausible for this long before others get alerts about it."""


class _Sample(NamedTuple):
    motion: Motion
    boot_s: float


class MotionCheck:
    """For one drone. Feed it the newest motion regularly; read `why` and `is_known`."""

    def __init__(self) -> None:
        self.why: Why | None = None
        """What was found last; None when nothing was for QUARANTINE_S."""
        self._found_at = float("-inf")
        self._plausible_since: float | None = None
        self._last: _Sample | None = None
        self._window: _Sample | None = None
        self._north_m = self._east_m = self._way_m = 0.0
        """What the speeds make of the time since `_window`."""

    def check(self, motion: Motion, boot_s: float, now: float) -> bool:
        """`boot_s`: the autopilot's own time. Whether `why` changed."""
        before = self.why
        if self._last is None or motion.at > self._last.motion.at:
            found = self._find(_Sample(motion, boot_s))
            if found is not None:
                self.why, self._found_at, self._plausible_since = found, now, now
        if self.why is not None and now - self._found_at >= QUARANTINE_S:
            self.why = None
        return self.why != before

    def is_settled(self, position_at: float) -> bool:
        """Whether `check` would find nothing: it has seen the position of that time, and nothing is to end."""
        last = self._last
        return last is not None and self.why is None and position_at <= last.motion.at

    def is_known(self, now: float) -> bool:
        """Whether its positions have been plausible for long enough."""
        since = self._plausible_since
        return self.why is None and since is not None and now - since >= KNOWN_FOR_S

    def _find(self, sample: _Sample) -> Why | None:
        motion = sample.motion
        last, self._last = self._last, sample
        if self._plausible_since is None:
            self._plausible_since = motion.at
        if hypot(motion.north_m_s, motion.east_m_s) > FASTEST_M_S or abs(motion.up_m_s) > FASTEST_CLIMB_M_S:
            return "speed"
        if not LOWEST_M <= motion.alt_amsl_m <= HIGHEST_M:
            return "height"
        if abs(motion.lat_deg) > 90.0 or abs(motion.lon_deg) > 180.0:
            return "jump"
        if last is None or self._window is None:
            self._begin_window(sample)
            return None
        north_m, east_m, up_m = _moved(last.motion, motion)
        covered_m = hypot(north_m, east_m, up_m)
        for_s = motion.at - last.motion.at
        if covered_m > JUMP_M + COVERS_M_S * (for_s + LATE_S):
            self._begin_window(sample)
            return "jump"
        boot_s = sample.boot_s - last.boot_s
        if not 0.0 < boot_s <= CLOCK_FASTER * for_s + CLOCK_AHEAD_S:
            boot_s = for_s
        fastest = max(_speed(last.motion), _speed(motion))
        if covered_m > JUMP_M + 2.0 * fastest * boot_s + 5.0 * boot_s:
            self._begin_window(sample)
            return "jump"
        self._north_m += (last.motion.north_m_s + motion.north_m_s) / 2.0 * boot_s
        self._east_m += (last.motion.east_m_s + motion.east_m_s) / 2.0 * boot_s
        self._way_m += (
            hypot(last.motion.north_m_s + motion.north_m_s, last.motion.east_m_s + motion.east_m_s) / 2 * boot_s
        )
        return self._check_course(sample)

    def _check_course(self, sample: _Sample) -> Why | None:
        window = self._window
        if window is None or sample.motion.at - window.motion.at < COURSE_OVER_S:
            return None
        north_m, east_m, up_m = _moved(window.motion, sample.motion)
        for_s = sample.motion.at - window.motion.at
        if hypot(north_m, east_m, up_m) > JUMP_M + COVERS_M_S * (for_s + LATE_S):
            self._begin_window(sample)
            return "jump"
        off_m = hypot(north_m - self._north_m, east_m - self._east_m)
        allowed_m = COURSE_OFF_M + COURSE_OFF_SHARE * self._way_m
        self._begin_window(sample)
        return "course" if off_m > allowed_m else None

    def _begin_window(self, sample: _Sample) -> None:
        self._window = sample
        self._north_m = self._east_m = self._way_m = 0.0


def _speed(motion: Motion) -> float:
    return hypot(motion.north_m_s, motion.east_m_s, motion.up_m_s)


def _moved(before: Motion, after: Motion) -> tuple[float, float, float]:
    """North, east, up."""
    lon_deg = (after.lon_deg - before.lon_deg + 180.0) % 360.0 - 180.0
    scale_m = METRES_PER_DEGREE * cos(radians(after.lat_deg))
    north_m = (after.lat_deg - before.lat_deg) * METRES_PER_DEGREE
    return north_m, lon_deg * scale_m, after.alt_amsl_m - before.alt_amsl_m
