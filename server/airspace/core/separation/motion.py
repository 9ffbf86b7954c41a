"""Position and motion of a drone from GLOBAL_POSITION_INT, and the geometry between two of them. Pure."""

from math import atan2, cos, degrees, hypot, radians
from struct import Struct
from typing import Final, NamedTuple, Self

from wire.frames import payload
from wire.places import place_of

METRES_PER_DEGREE: Final = 111_319.5

_FIELDS: Final = Struct("<Iiiiihhh")
"""time, latitude, longitude (degrees times 10^7), height above the sea and above home (mm), velocity north, east, down
(cm/s)."""


class Motion(NamedTuple):
    """`at`: monotonic seconds when the tower had it. Velocities in metres a second."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    north_m_s: float
    east_m_s: float
    up_m_s: float
    at: float


def motion_in(frame: bytes, at: float) -> Motion | None:
    """From a whole GLOBAL_POSITION_INT; None while the autopilot has no position."""
    _, lat_e7, lon_e7, alt_mm, _, north, east, down = _FIELDS.unpack_from(payload(frame).ljust(_FIELDS.size, b"\0"))
    place = place_of(lat_e7, lon_e7)
    return None if place is None else Motion(*place, alt_mm / 1000, north / 100, east / 100, -down / 100, at)


def boot_s_in(frame: bytes) -> float:
    """From a whole GLOBAL_POSITION_INT: the autopilot's own time, seconds since power-on."""
    boot_ms: int = _FIELDS.unpack_from(payload(frame).ljust(_FIELDS.size, b"\0"))[0]
    return boot_ms / 1000


class Relative(NamedTuple):
    """One drone as another one sees it: metres away, and metres a second by which that changes."""

    east_m: float
    north_m: float
    up_m: float
    east_m_s: float
    north_m_s: float
    up_m_s: float

    @classmethod
    def of(cls, own: Motion, other: Motion, now: float) -> Self:
        """Both moved on to `now` as they flew. On a flat piece of earth: good for some kilometres, poles apart."""
        own_age, other_age = now - own.at, now - other.at
        scale_m = METRES_PER_DEGREE * cos(radians(own.lat_deg))
        lon_deg = (other.lon_deg - own.lon_deg + 180.0) % 360.0 - 180.0
        return cls(
            lon_deg * scale_m + other.east_m_s * other_age - own.east_m_s * own_age,
            (other.lat_deg - own.lat_deg) * METRES_PER_DEGREE + other.north_m_s * other_age - own.north_m_s * own_age,
            other.alt_amsl_m - own.alt_amsl_m + other.up_m_s * other_age - own.up_m_s * own_age,
            other.east_m_s - own.east_m_s,
            other.north_m_s - own.north_m_s,
            other.up_m_s - own.up_m_s,
        )

    @property
    def distance_m(self) -> float:
        """Over ground."""
        return hypot(self.east_m, self.north_m)

    @property
    def bearing_deg(self) -> float:
        """In which direction the other one is: clockwise from north, 0 to 360."""
        return degrees(atan2(self.east_m, self.north_m)) % 360.0

    def seen_back(self) -> "Relative":
        """The first one as the other sees it."""
        return Relative(*(-value for value in self))
