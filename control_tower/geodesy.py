"""Distances and offsets over ground, on a sphere: good to 0.5 % up to 100 km."""

from __future__ import annotations

from math import atan2, cos, degrees, hypot, radians, sin, sqrt
from typing import Final

EARTH_M: Final = 6_371_000.0


def distance_m(lat_deg: float, lon_deg: float, other_lat_deg: float, other_lon_deg: float) -> float:
    """Returns the great-circle distance of two places."""
    lat, other = radians(lat_deg), radians(other_lat_deg)
    half_lat, half_lon = (other - lat) / 2, radians(other_lon_deg - lon_deg) / 2
    chord = sin(half_lat) ** 2 + cos(lat) * cos(other) * sin(half_lon) ** 2
    return 2 * EARTH_M * atan2(sqrt(chord), sqrt(max(0.0, 1 - chord)))


def offset(lat_deg: float, lon_deg: float, north_m: float, east_m: float) -> tuple[float, float]:
    """Returns the place so many metres north and east; for less than 100 km, not at the poles."""
    north = degrees(north_m / EARTH_M)
    return lat_deg + north, lon_deg + degrees(east_m / (EARTH_M * cos(radians(lat_deg + north / 2))))


def turned(north_m: float, east_m: float, by_deg: float) -> tuple[float, float]:
    """Returns an offset turned clockwise, as a formation turns with its leader."""
    length, angle = hypot(north_m, east_m), atan2(east_m, north_m) + radians(by_deg)
    return length * cos(angle), length * sin(angle)
