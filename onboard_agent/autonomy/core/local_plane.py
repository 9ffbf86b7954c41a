"""Metres north and east of a place on the map, for flights of some kilometres. Pure."""

from dataclasses import dataclass
from math import cos, radians
from typing import Final

METRES_PER_DEGREE: Final = 111_319.5


@dataclass(frozen=True, slots=True)
class LocalPlane:
    """The plane that touches the earth at this place."""

    lat_deg: float
    lon_deg: float

    @property
    def _east_m_per_degree(self) -> float:
        return METRES_PER_DEGREE * max(0.01, cos(radians(self.lat_deg)))

    def local(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        """Returns metres north and east."""
        east_deg = (lon_deg - self.lon_deg + 180.0) % 360.0 - 180.0
        return (lat_deg - self.lat_deg) * METRES_PER_DEGREE, east_deg * self._east_m_per_degree

    def on_map(self, north_m: float, east_m: float) -> tuple[float, float]:
        """Returns latitude and longitude in degrees."""
        lon_deg = self.lon_deg + east_m / self._east_m_per_degree
        return self.lat_deg + north_m / METRES_PER_DEGREE, (lon_deg + 180.0) % 360.0 - 180.0
