"""Latitude and longitude to metres and back, with ArduPilot's own flat-earth approximation.

Accurate to centimetres within a few kilometres of the origin, enough for a quadrotor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

METRES_PER_E7 = 0.011131884502145034
"""Metres per 1e-7 degree of latitude."""


@dataclass(frozen=True, slots=True)
class Place:
    """A point on the earth: degrees, and metres above mean sea level."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float


class LocalFrame:
    """North and east metres around an origin; down is measured from the origin's altitude."""

    def __init__(self, origin: Place) -> None:
        self.origin = origin
        self._lon_scale = max(math.cos(math.radians(origin.lat_deg)), 0.01)

    def to_place(self, north_m: float, east_m: float, down_m: float) -> Place:
        lat_deg = self.origin.lat_deg + north_m / METRES_PER_E7 * 1e-7
        lon_deg = self.origin.lon_deg + east_m / (METRES_PER_E7 * self._lon_scale) * 1e-7
        return Place(lat_deg, wrap_180(lon_deg), self.origin.alt_amsl_m - down_m)

    def to_local(self, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        """Returns north and east, metres."""
        north_m = (lat_deg - self.origin.lat_deg) * 1e7 * METRES_PER_E7
        east_m = wrap_180(lon_deg - self.origin.lon_deg) * 1e7 * METRES_PER_E7 * self._lon_scale
        return north_m, east_m


def e7(degrees: float) -> int:
    """Converts degrees to MAVLink's integers."""
    return round(degrees * 1e7)


def wrap_180(degrees: float) -> float:
    return (degrees + 180.0) % 360.0 - 180.0


def wrap_pi(radians: float) -> float:
    return (radians + math.pi) % (2.0 * math.pi) - math.pi


def heading_deg(yaw_rad: float) -> float:
    """Converts a yaw angle to 0..360."""
    return math.degrees(yaw_rad) % 360.0


def clamp(value: float, low: float, high: float) -> float:
    return low if value < low else high if value > high else value
