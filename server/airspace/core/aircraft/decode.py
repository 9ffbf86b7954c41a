"""Aircraft as receivers on board report them: ADSB_VEHICLE, COLLISION, and Remote ID (OPEN_DRONE_ID_*). Pure.

A report names what it is of; where it says nothing of a value, that is None.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import cos, radians, sin
from struct import Struct
from typing import Final

from server.airspace.core.separation.motion import Motion
from wire.dialect import mavlink
from wire.frames import message_id, payload
from wire.places import place_of

ADSB_VEHICLE: Final = int(mavlink.MAVLINK_MSG_ID_ADSB_VEHICLE)
COLLISION: Final = int(mavlink.MAVLINK_MSG_ID_COLLISION)
BASIC_ID: Final = int(mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_BASIC_ID)
LOCATION: Final = int(mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_LOCATION)
READ: Final = frozenset({ADSB_VEHICLE, COLLISION, BASIC_ID, LOCATION})
"""The only messages that are looked at."""

_ADSB: Final = Struct("<IiiiHHhHHB9sBB")
_BASIC: Final = Struct("<BB20sBB20s")
_LOCATION: Final = Struct("<iiffffHHhBB20sB7x")
_COLLISION: Final = Struct("<IfffBBB")
_VALID_PLACE, _VALID_HEIGHT, _VALID_COURSE, _VALID_SPEED, _VALID_CALL, _VALID_SQUAWK = 1, 2, 4, 8, 16, 32
_VALID_CLIMB: Final = 128
_UNKNOWN_COURSE: Final = 36_000
_UNKNOWN_SPEED: Final = 25_500
_UNKNOWN_CLIMB: Final = 6_300
_NO_HEIGHT: Final = -1000.0
_ON_GROUND: Final = 1
_UAV: Final = 14
"""ADSB_EMITTER_TYPE_UAV."""


class Kind(StrEnum):
    MANNED = "manned"
    """By ADS-B, unless its emitter says that it is unmanned."""
    UNMANNED = "unmanned"


@dataclass(frozen=True, slots=True)
class Report:
    """One aircraft at one moment. `key`: the same for the same aircraft, whoever hears it."""

    key: str
    kind: Kind
    name: str
    """Call sign or serial number; empty: not known."""
    motion: Motion
    has_height: bool = True
    """Otherwise the height in `motion` is not known."""
    course_deg: float | None = None
    speed_m_s: float | None = None
    squawk: int | None = None
    on_ground: bool = False


@dataclass(frozen=True, slots=True)
class Identity:
    """The serial number of a Remote ID sender."""

    key: str
    name: str


@dataclass(frozen=True, slots=True)
class Threat:
    """The autopilot's own avoidance names an aircraft. Metres and seconds; a level from 0 to 2."""

    key: str
    level: int
    in_s: float
    horizontal_m: float
    vertical_m: float


def read(frame: bytes, at: float) -> Report | Identity | Threat | None:
    """From a whole frame of READ; None where it says nothing of use."""
    kind, body = message_id(frame), payload(frame)
    if kind == ADSB_VEHICLE:
        return _adsb(body.ljust(_ADSB.size, b"\0"), at)
    if kind == LOCATION:
        return _location(body.ljust(_LOCATION.size, b"\0"), at)
    if kind == BASIC_ID:
        _, _, sender, _, _, serial = _BASIC.unpack_from(body.ljust(_BASIC.size, b"\0"))
        return Identity(_remote_key(sender), _text(serial))
    if kind == COLLISION:
        number, in_s, vertical_m, horizontal_m, source, _, level = _COLLISION.unpack_from(
            body.ljust(_COLLISION.size, b"\0")
        )
        return Threat(_icao_key(number), level, in_s, horizontal_m, vertical_m) if source == 0 else None
    return None


def _adsb(body: bytes, at: float) -> Report | None:
    icao, lat, lon, alt_mm, course, speed, climb, flags, squawk, _, call, emitter, since_s = _ADSB.unpack_from(body)
    place = place_of(lat, lon)
    if not flags & _VALID_PLACE or place is None:
        return None
    course_deg = course / 100 if flags & _VALID_COURSE else None
    speed_m_s = speed / 100 if flags & _VALID_SPEED else None
    motion = _motion(place, alt_mm / 1000, course_deg, speed_m_s, climb / 100 if flags & _VALID_CLIMB else 0.0,
                     at - min(since_s, 255))  # fmt: skip
    return Report(
        _icao_key(icao),
        Kind.UNMANNED if emitter == _UAV else Kind.MANNED,
        _text(call) if flags & _VALID_CALL else "",
        motion,
        bool(flags & _VALID_HEIGHT),
        course_deg,
        speed_m_s,
        squawk if flags & _VALID_SQUAWK else None,
    )


def _location(body: bytes, at: float) -> Report | None:
    lat, lon, _, geodetic_m, _, _, course, speed, climb, _, _, sender, status = _LOCATION.unpack_from(body)
    place = place_of(lat, lon)
    if place is None:
        return None
    course_deg = course / 100 if course < _UNKNOWN_COURSE else None
    speed_m_s = speed / 100 if speed < _UNKNOWN_SPEED else None
    climb_m_s = climb / 100 if abs(climb) < _UNKNOWN_CLIMB else 0.0
    has_height = geodetic_m > _NO_HEIGHT
    motion = _motion(place, geodetic_m if has_height else 0.0, course_deg, speed_m_s, climb_m_s, at)
    key = _remote_key(sender)
    return Report(key, Kind.UNMANNED, "", motion, has_height, course_deg, speed_m_s, None, status == _ON_GROUND)


def _motion(
    place: tuple[float, float],
    alt_m: float,
    course_deg: float | None,
    speed_m_s: float | None,
    up_m_s: float,
    at: float,
) -> Motion:
    course, speed = radians(course_deg or 0.0), speed_m_s if course_deg is not None and speed_m_s is not None else 0.0
    return Motion(*place, alt_m, speed * cos(course), speed * sin(course), up_m_s, at)


def _icao_key(icao: int) -> str:
    return f"icao:{icao & 0xFFFFFF:06x}"


def _remote_key(sender: bytes) -> str:
    return f"rid:{sender.hex()}"


def _text(raw: bytes) -> str:
    """Printable ASCII only: it comes through the air from anybody."""
    text = raw.split(b"\0", 1)[0].decode("ascii", "replace")
    return "".join(one for one in text if one.isascii() and one.isprintable()).strip()[:20]
