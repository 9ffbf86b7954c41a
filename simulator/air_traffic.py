"""Other aircraft, as a receiver on board would report them: circling and passing by, for demonstration."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from simulator.dialect import Message, mavlink
from simulator.flight import Flight
from simulator.geodesy import Place, e7

EVERY_S = 1.0
_KNOWN = 1 | 2 | 4 | 8 | 16 | 128
"""Place, height, course, speed, call sign and climb."""
_EARTH_M = 111_319.5


@dataclass(frozen=True)
class _Aircraft:
    """On a circle around home, clockwise."""

    icao: int
    call: str
    radius_m: float
    above_home_m: float
    speed_mps: float
    emitter: int


_ALL = (
    _Aircraft(0x4B1901, "HELI1", 1_800.0, 150.0, 45.0, 7),
    _Aircraft(0x4B1902, "GLIDER2", 3_500.0, 600.0, 28.0, 9),
    _Aircraft(0x4B1903, "TWR42", 9_000.0, 2_400.0, 120.0, 3),
)


class AirTraffic:
    """Around `home`. Call `due` at each tick."""

    def __init__(self, home: Place) -> None:
        self._home = home
        self._next_s = 0.0

    def due(self, flight: Flight) -> Iterator[Message]:
        if flight.now_s < self._next_s:
            return
        self._next_s = flight.now_s + EVERY_S
        home = self._home
        for number, one in enumerate(_ALL):
            turned = flight.now_s * one.speed_mps / one.radius_m + number * 2.1
            north, east = one.radius_m * math.cos(turned), one.radius_m * math.sin(turned)
            lat_deg = home.lat_deg + north / _EARTH_M
            lon_deg = home.lon_deg + east / _EARTH_M / math.cos(math.radians(home.lat_deg))
            course_deg = (math.degrees(turned) + 90.0) % 360.0
            yield mavlink.MAVLink_adsb_vehicle_message(
                one.icao,
                e7(lat_deg),
                e7(lon_deg),
                0,
                round((home.alt_amsl_m + one.above_home_m) * 1000),
                round(course_deg * 100),
                round(one.speed_mps * 100),
                0,
                one.call.encode(),
                one.emitter,
                0,
                _KNOWN,
                0,
            )
