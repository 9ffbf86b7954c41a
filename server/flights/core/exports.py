"""A flight in formats of other programs: CSV, KML and GPX, one piece of text after the other. Pure.

Each row or point is a position that the autopilot reported, with what was last known of the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from typing import Final
from xml.sax.saxutils import escape

from server.flights.core.track import Fix

COLUMNS: Final = (
    "time_utc",
    "time_us",
    "lat_deg",
    "lon_deg",
    "alt_msl_m",
    "alt_rel_m",
    "north_m_s",
    "east_m_s",
    "down_m_s",
    "course_deg",
    "roll_deg",
    "pitch_deg",
    "yaw_deg",
    "custom_mode",
    "armed",
    "battery_v",
    "battery_percent",
)

Export = Callable[[str, Iterable[Fix]], Iterator[str]]
"""Takes a title and the positions."""


def csv(title: str, fixes: Iterable[Fix]) -> Iterator[str]:
    """RFC 4180, with a line of names. An empty field: not known."""
    yield ",".join(COLUMNS) + "\r\n"
    for fix in fixes:
        yield (
            f"{_time(fix.at_us)},{fix.at_us},{fix.lat_deg:.7f},{fix.lon_deg:.7f},{fix.alt_msl_m:.3f},"
            f"{fix.alt_rel_m:.3f},{fix.north_m_s:.2f},{fix.east_m_s:.2f},{fix.down_m_s:.2f},{_fixed(fix.course_deg)},"
            f"{_fixed(fix.roll_deg)},{_fixed(fix.pitch_deg)},{_fixed(fix.yaw_deg)},{_plain(fix.mode)},"
            f"{_plain(None if fix.armed is None else int(fix.armed))},{_fixed(fix.battery_v)},"
            f"{_plain(fix.battery_percent)}\r\n"
        )


def kml(title: str, fixes: Iterable[Fix]) -> Iterator[str]:
    """A path of Google Earth with times (gx:Track), heights above sea level."""
    yield '<?xml version="1.0" encoding="UTF-8"?>\n'
    yield '<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">\n'
    yield f"<Document><name>{_text(title)}</name>\n<Placemark><name>{_text(title)}</name>\n<gx:Track>\n"
    yield "<altitudeMode>absolute</altitudeMode>\n"
    for fix in fixes:
        yield f"<when>{_time(fix.at_us)}</when>"
        yield f"<gx:coord>{fix.lon_deg:.7f} {fix.lat_deg:.7f} {fix.alt_msl_m:.3f}</gx:coord>\n"
    yield "</gx:Track>\n</Placemark></Document>\n</kml>\n"


def gpx(title: str, fixes: Iterable[Fix]) -> Iterator[str]:
    """GPX 1.1, one track."""
    yield '<?xml version="1.0" encoding="UTF-8"?>\n'
    yield '<gpx version="1.1" creator="Control Tower" xmlns="http://www.topografix.com/GPX/1/1">\n'
    yield f"<trk><name>{_text(title)}</name><trkseg>\n"
    for fix in fixes:
        yield f'<trkpt lat="{fix.lat_deg:.7f}" lon="{fix.lon_deg:.7f}"><ele>{fix.alt_msl_m:.3f}</ele>'
        yield f"<time>{_time(fix.at_us)}</time></trkpt>\n"
    yield "</trkseg></trk>\n</gpx>\n"


def _time(at_us: int) -> str:
    return datetime.fromtimestamp(at_us // 1000 / 1000, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _fixed(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"


def _plain(value: int | None) -> str:
    return "" if value is None else str(value)


def _text(text: str) -> str:
    """For XML 1.0, which has no control characters."""
    return escape("".join(letter for letter in text if letter.isprintable()))
