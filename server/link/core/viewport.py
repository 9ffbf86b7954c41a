"""The part of the map that one browser shows: which drones are outside it, so that they need fewer frames. Pure."""

from dataclasses import dataclass
from struct import Struct
from typing import Final

from wire.dialect import mavlink
from wire.frames import payload
from wire.places import place_of

POSITION: Final = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT

_PLACE: Final = Struct("<Iii")
"""The beginning of GLOBAL_POSITION_INT: time, latitude, longitude (degrees times 10^7)."""


@dataclass(frozen=True)
class Viewport:
    """Degrees. `west_deg` above `east_deg`: it crosses the antimeridian."""

    south_deg: float
    west_deg: float
    north_deg: float
    east_deg: float

    def shows(self, lat_deg: float, lon_deg: float) -> bool:
        """Whether a place is inside, its edges included."""
        if not self.south_deg <= lat_deg <= self.north_deg:
            return False
        if self.west_deg <= self.east_deg:
            return self.west_deg <= lon_deg <= self.east_deg
        return lon_deg >= self.west_deg or lon_deg <= self.east_deg


def place_in(frame: bytes) -> tuple[float, float] | None:
    """(latitude, longitude) in degrees from a whole GLOBAL_POSITION_INT; None while the autopilot has no position."""
    _, lat_e7, lon_e7 = _PLACE.unpack_from(payload(frame).ljust(_PLACE.size, b"\0"))
    return place_of(lat_e7, lon_e7)
