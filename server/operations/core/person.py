"""A person whom a drone follows: which fixes of their browser count, and the resulting position. Pure.

Rules, each tested:

- A fix counts if it is newer than the last, accurate enough, and within reach of a person.
- All fixes come from one browser, the first of the sign-in that made the request. Two would pull the drone to and fro.
- The height is the drone's own at the start, because heights from browsers are wrong by tens of metres.
"""

from math import cos, hypot, isfinite, radians, sin
from typing import Final, NamedTuple

from server.airspace.core.separation.motion import METRES_PER_DEGREE, Motion
from server.kernel.people import SignInId

ACCURATE_M: Final = 20.0
"""Worse fixes do not count; nor those that are less sure than the drone is away, which might be above the person."""

FASTEST_M_S: Final = 12.0
"""For a person on foot or on a bicycle. Two accurate fixes further apart than this are wrong."""

MIN_M: Final = 8.0
"""From the person, over ground."""

USUAL_M: Final = 15.0
MAX_M: Final = 50.0


class Fix(NamedTuple):
    """`at`: monotonic seconds when it was measured. Speed and heading (clockwise from north), where they are known."""

    lat_deg: float
    lon_deg: float
    accuracy_m: float
    at: float
    speed_m_s: float | None = None
    heading_deg: float | None = None


def sure_m(away_m: float) -> float:
    """How sure a fix must be for a drone that is so far away."""
    return min(ACCURATE_M, away_m)


class PersonTrack:
    """Where the person is. `alt_amsl_m`: the drone's own height, kept. `sign_in`: whose fixes count."""

    def __init__(self, first: Fix, *, alt_amsl_m: float, away_m: float, sign_in: SignInId) -> None:
        self.sign_in = sign_in
        self.browser: int | None = None
        """The number of the one whose fixes count; None before its first one."""
        self._newest = first
        self._alt_amsl_m = alt_amsl_m
        self._sure_m = sure_m(away_m)

    def take(self, fix: Fix, *, browser: int, sign_in: SignInId) -> str | None:
        """Why it does not count, or None."""
        if sign_in != self.sign_in or self.browser not in (None, browser):
            return "another browser's"
        if fix.at <= self._newest.at:
            return "older than the last"
        if not fix.accuracy_m <= self._sure_m:
            return "not sure enough"
        if self._moved_m(fix) > FASTEST_M_S * (fix.at - self._newest.at) + max(fix.accuracy_m, self._newest.accuracy_m):
            return "too far from the last"
        self.browser, self._newest = browser, fix
        return None

    def motion(self) -> Motion:
        """At the drone's height, from the newest fix."""
        fix = self._newest
        speed, heading = fix.speed_m_s, fix.heading_deg
        north = east = 0.0
        if speed is not None and heading is not None and isfinite(speed) and isfinite(heading):
            speed = min(max(0.0, speed), FASTEST_M_S)
            north, east = speed * cos(radians(heading)), speed * sin(radians(heading))
        return Motion(fix.lat_deg, fix.lon_deg, self._alt_amsl_m, north, east, 0.0, fix.at)

    def _moved_m(self, fix: Fix) -> float:
        last = self._newest
        east = (fix.lon_deg - last.lon_deg + 180.0) % 360.0 - 180.0
        north_m = (fix.lat_deg - last.lat_deg) * METRES_PER_DEGREE
        return hypot(north_m, east * METRES_PER_DEGREE * cos(radians(last.lat_deg)))
