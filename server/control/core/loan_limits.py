"""The limits of a loan, and when a drone flown by hand is beyond them. Pure.

What a borrower's frame may ask for is in `loan_requests.py`.
"""

from dataclasses import dataclass
from math import cos, hypot, radians
from struct import Struct
from typing import Final

from wire.frames import payload
from wire.places import place_of

_METRES_PER_DEGREE: Final = 111_319.5
HEIGHT_STEP_M: Final = 3.0
RADIUS_STEP_M: Final = 5.0
"""Beyond a limit the drone holds again each time it is this much further out; the way back is free."""

_HOME: Final = Struct("<iii")
_POSITION: Final = Struct("<Iiiii")


@dataclass(frozen=True)
class Limits:
    """Metres above and around home; None: no limit."""

    may_arm: bool = True
    max_height_m: float | None = None
    radius_m: float | None = None

    @property
    def in_space(self) -> bool:
        return self.max_height_m is not None or self.radius_m is not None

    @property
    def any(self) -> bool:
        return self.in_space or not self.may_arm


@dataclass(frozen=True)
class Home:
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float

    def distance_m(self, lat_deg: float, lon_deg: float) -> float:
        """Over ground; good for the few kilometres of a radius."""
        north = (lat_deg - self.lat_deg) * _METRES_PER_DEGREE
        east = (lon_deg - self.lon_deg) * _METRES_PER_DEGREE * cos(radians(self.lat_deg))
        return hypot(north, east)


@dataclass(frozen=True)
class Place:
    """From GLOBAL_POSITION_INT."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    alt_rel_m: float


def home_in(frame: bytes) -> Home | None:
    """From a whole HOME_POSITION frame; None where that is no place."""
    lat_e7, lon_e7, alt_mm = _HOME.unpack_from(payload(frame).ljust(_HOME.size, b"\0"))
    place = place_of(lat_e7, lon_e7)
    return None if place is None else Home(*place, alt_mm / 1000)


def whole_place_in(frame: bytes) -> Place | None:
    """From a whole GLOBAL_POSITION_INT frame; None while the autopilot has no position, or an impossible one."""
    _, lat_e7, lon_e7, alt_mm, rel_mm = _POSITION.unpack_from(payload(frame).ljust(_POSITION.size, b"\0"))
    place = place_of(lat_e7, lon_e7)
    return None if place is None else Place(*place, alt_mm / 1000, rel_mm / 1000)


class LimitWatch:
    """Says when a drone that is flown by hand beyond its limits has to hold."""

    def __init__(self) -> None:
        self._held_height_m = 0.0
        self._held_radius_m = 0.0

    def must_hold(self, limits: Limits, place: Place, home: Home | None) -> str | None:
        """The violation in words, or None. Once at the limit, and again at each further step."""
        why = None
        if limits.max_height_m is not None:
            beyond = place.alt_rel_m - limits.max_height_m
            self._held_height_m, passed = _ratchet(beyond, self._held_height_m, HEIGHT_STEP_M)
            why = f"above the {limits.max_height_m:.0f} m of the loan" if passed else why
        if limits.radius_m is not None and home is not None:
            beyond = home.distance_m(place.lat_deg, place.lon_deg) - limits.radius_m
            self._held_radius_m, passed = _ratchet(beyond, self._held_radius_m, RADIUS_STEP_M)
            why = f"further from home than the {limits.radius_m:.0f} m of the loan" if passed else why
        return why


def _ratchet(beyond_m: float, allowed_m: float, step_m: float) -> tuple[float, bool]:
    """(how far out it may be from now on, whether it has just gone further than that)."""
    if beyond_m <= 0:
        return 0.0, False
    if beyond_m > allowed_m:
        return beyond_m + step_m, True
    return min(allowed_m, beyond_m + step_m), False
