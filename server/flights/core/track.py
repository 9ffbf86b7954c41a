"""What a drone's own messages say of its flight: where it was, and how far it flew. Pure.

Only messages of the autopilot count (component 1). Distances are over ground, in metres.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from struct import Struct
from typing import Final

from server.flights.core.tlog import Entry
from wire.dialect import mavlink
from wire.frames import message_id, payload, source
from wire.places import place_of

_AUTOPILOT: Final = mavlink.MAV_COMP_ID_AUTOPILOT1
_ARMED: Final = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_HEARTBEAT: Final = Struct("<IBBBBB")
_POSITION: Final = Struct("<IiiiihhhH")
_ATTITUDE: Final = Struct("<Iffffff")
_STATUS: Final = Struct("<IIIHHhHHHHHHb")
_METRES_PER_DEGREE: Final = 111_319.49
MIN_MOVE_M: Final = 2.0
"""A receiver that stands still wanders by about a metre."""
MAX_TRACK_POINTS: Final = 200


@dataclass(frozen=True)
class Fix:
    """One position, with what was last known of the rest; None: not known. `course_deg`: where the nose points."""

    at_us: int
    lat_deg: float
    lon_deg: float
    alt_msl_m: float
    alt_rel_m: float
    north_m_s: float
    east_m_s: float
    down_m_s: float
    course_deg: float | None
    roll_deg: float | None
    pitch_deg: float | None
    yaw_deg: float | None
    mode: int | None
    armed: bool | None
    battery_v: float | None
    battery_percent: int | None


class FixReader:
    """Takes the entries of a `.tlog` in order."""

    def __init__(self) -> None:
        self._attitude: tuple[float, float, float] | None = None
        self._mode: int | None = None
        self.armed: bool | None = None
        self._battery_v: float | None = None
        self._battery_percent: int | None = None

    def take(self, entry: Entry) -> Fix | None:
        """The position that this entry tells of, if it does."""
        frame = entry.frame
        kind = message_id(frame)
        if kind not in _READ or source(frame)[1] != _AUTOPILOT:
            return None
        layout = _READ[kind]
        values = layout.unpack_from(payload(frame).ljust(layout.size, b"\0"))
        if kind == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
            return self._fix(entry.at_us, values)
        if kind == mavlink.MAVLINK_MSG_ID_ATTITUDE:
            roll, pitch, yaw = (math.degrees(one) for one in values[1:4])
            self._attitude = roll, pitch, yaw
        elif kind == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._mode, self.armed = values[0], bool(values[3] & _ARMED)
        else:
            self._battery_v = None if values[4] == 0xFFFF else values[4] / 1000
            self._battery_percent = None if values[12] < 0 else values[12]
        return None

    def _fix(self, at_us: int, values: tuple[int, ...]) -> Fix | None:
        _, lat_e7, lon_e7, alt_mm, rel_mm, north, east, down, course = values
        place = place_of(lat_e7, lon_e7)
        if place is None:
            return None
        roll, pitch, yaw = self._attitude or (None, None, None)
        return Fix(
            at_us=at_us,
            lat_deg=place[0],
            lon_deg=place[1],
            alt_msl_m=alt_mm / 1000,
            alt_rel_m=rel_mm / 1000,
            north_m_s=north / 100,
            east_m_s=east / 100,
            down_m_s=down / 100,
            course_deg=None if course == 0xFFFF else course / 100,
            roll_deg=roll,
            pitch_deg=pitch,
            yaw_deg=yaw,
            mode=self._mode,
            armed=self.armed,
            battery_v=self._battery_v,
            battery_percent=self._battery_percent,
        )


_READ: Final = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: _HEARTBEAT,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _POSITION,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: _ATTITUDE,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: _STATUS,
}


def fixes_in(entries: Iterator[Entry]) -> Iterator[Fix]:
    """The positions among the entries, in order."""
    reader = FixReader()
    for entry in entries:
        fix = reader.take(entry)
        if fix is not None:
            yield fix


@dataclass
class FlightSummary:
    """The sum of a whole flight. Feed it every entry. `whole_bytes`: up to the end of the last entry. `began_us`: times
    before it count as frames only, because the drone was not armed."""

    began_us: int
    frames: int = 0
    whole_bytes: int = 0
    last_us: int = 0
    distance_m: float = 0.0
    max_height_m: float | None = None
    track: list[tuple[float, float]] = field(default_factory=list)
    """At most `MAX_TRACK_POINTS` positions, in degrees, spread over the way."""
    _reader: FixReader = field(default_factory=FixReader)
    _last: Fix | None = None
    _step_m: float = MIN_MOVE_M
    _since_point_m: float = 0.0

    def skip(self, entry: Entry) -> None:
        """One of another vehicle."""
        self.frames += 1
        self.whole_bytes, self.last_us = entry.end, entry.at_us

    def take(self, entry: Entry) -> None:
        self.skip(entry)
        fix = self._reader.take(entry)
        if fix is None or fix.at_us < self.began_us:
            return
        self.max_height_m = max(fix.alt_rel_m, fix.alt_rel_m if self.max_height_m is None else self.max_height_m)
        if self._last is None:
            self._last = fix
            self.track.append((fix.lat_deg, fix.lon_deg))
            return
        moved_m = _distance_m(self._last, fix)
        if moved_m < MIN_MOVE_M:
            return
        self._last = fix
        self.distance_m += moved_m
        self._since_point_m += moved_m
        if self._since_point_m >= self._step_m:
            self._since_point_m = 0.0
            self._add_point(fix)

    def _add_point(self, fix: Fix) -> None:
        self.track.append((fix.lat_deg, fix.lon_deg))
        if len(self.track) > MAX_TRACK_POINTS:
            del self.track[1::2]
            self._step_m *= 2


def _distance_m(one: Fix, other: Fix) -> float:
    north = (other.lat_deg - one.lat_deg) * _METRES_PER_DEGREE
    east_deg = (other.lon_deg - one.lon_deg + 180) % 360 - 180
    return math.hypot(north, east_deg * _METRES_PER_DEGREE * math.cos(math.radians(one.lat_deg)))
