"""Aircraft as a receiver on the ground reports them: `aircraft.json` of dump1090 and readsb. Pure.

Feet, knots and feet a minute there; metres here. Bounded, and whatever is not a number is left out.
"""

from collections.abc import Iterator
from math import cos, isfinite, radians, sin
from typing import Any, Final

import msgspec

from server.airspace.core.aircraft.decode import Kind, Report
from server.airspace.core.separation.motion import Motion

MAX_FEED_BYTES: Final = 4_000_000
MAX_READ: Final = 2_000
"""Aircraft of one file. A receiver hears some hundreds."""
MAX_AGE_S: Final = 60.0
_FOOT_M: Final = 0.3048
_KNOT_M_S: Final = 0.514444
_UNMANNED: Final = "B6"
"""Emitter category of ADS-B: unmanned aerial vehicle."""


def reports_in(content: bytes, at: float) -> list[Report]:
    """Raises ValueError for what is no such file."""
    if len(content) > MAX_FEED_BYTES:
        raise ValueError(f"more than {MAX_FEED_BYTES} bytes")
    try:
        document = msgspec.json.decode(content)
    except (msgspec.DecodeError, RecursionError) as error:
        raise ValueError(f"no JSON: {error}") from None
    listed = document.get("aircraft") if isinstance(document, dict) else None
    if not isinstance(listed, list):
        raise ValueError("no list of aircraft in it")
    return list(_reports(listed[:MAX_READ], at))


def _reports(listed: list[Any], at: float) -> Iterator[Report]:
    for one in listed:
        if not isinstance(one, dict):
            continue
        lat, lon, address = _number(one.get("lat")), _number(one.get("lon")), one.get("hex")
        age_s = _number(one.get("seen_pos")) or 0.0
        if lat is None or lon is None or not isinstance(address, str) or not 0 <= age_s <= MAX_AGE_S:
            continue
        if not (abs(lat) <= 90 and abs(lon) <= 180):
            continue
        on_ground = one.get("alt_baro") == "ground"
        feet = _number(one.get("alt_geom"))
        feet = _number(one.get("alt_baro")) if feet is None else feet
        course, knots = _number(one.get("track")), _number(one.get("gs"))
        climb = _number(one.get("geom_rate"))
        climb = _number(one.get("baro_rate")) if climb is None else climb
        speed_m_s = None if knots is None else knots * _KNOT_M_S
        north = east = 0.0
        if course is not None and speed_m_s is not None:
            north, east = speed_m_s * cos(radians(course)), speed_m_s * sin(radians(course))
        motion = Motion(lat, lon, (feet or 0.0) * _FOOT_M, north, east, (climb or 0.0) * _FOOT_M / 60, at - age_s)
        name, squawk = one.get("flight"), one.get("squawk")
        yield Report(
            f"icao:{_clean(address).lower()[:8]}",
            Kind.UNMANNED if one.get("category") == _UNMANNED else Kind.MANNED,
            _clean(name) if isinstance(name, str) else "",
            motion,
            feet is not None,
            course,
            speed_m_s,
            int(squawk) if isinstance(squawk, str) and squawk.isascii() and squawk.isdigit() else None,
            on_ground,
        )


def _clean(text: str) -> str:
    return "".join(one for one in text[:20] if one.isascii() and one.isprintable()).strip()


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        return None
    return float(value)
