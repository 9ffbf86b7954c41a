"""ArduPilot's log format: records that begin with two fixed bytes and a type; an FMT record describes each type.

A small part of a real Copter's log, with its names and units.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from simulator.flight import Flight
from simulator.geodesy import e7, heading_deg
from simulator.reports_common import centi

HEAD = b"\xa3\x95"
FMT_TYPE = 128
UNIX_OF_GPS_EPOCH_S = 315_964_800
LEAP_SECONDS = 18
WEEK_S = 604_800

_CODES = {"Q": "Q", "B": "B", "M": "B", "H": "H", "I": "I", "L": "i", "f": "f", "c": "h", "C": "H", "e": "i"}
_CODES |= {"n": "4s", "N": "16s", "Z": "64s"}


@dataclass(frozen=True, slots=True)
class Kind:
    """One type of record. `letters` are the format's own: c and C are hundredths, e hundredths in 32 bits, L 1e-7."""

    number: int
    name: str
    letters: str
    labels: str

    @property
    def packing(self) -> str:
        return "<" + "".join(_CODES[letter] for letter in self.letters)

    def record(self, *values: float | bytes) -> bytes:
        return HEAD + bytes((self.number,)) + struct.pack(self.packing, *values)

    def described(self) -> bytes:
        length = len(HEAD) + 1 + struct.calcsize(self.packing)
        fields = (self.number, length, self.name.encode(), self.letters.encode(), self.labels.encode())
        return HEAD + bytes((FMT_TYPE,)) + struct.pack("<BB4s16s64s", *fields)


FMT = Kind(FMT_TYPE, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
PARM = Kind(129, "PARM", "QNff", "TimeUS,Name,Value,Default")
MSG = Kind(130, "MSG", "QZ", "TimeUS,Message")
MODE = Kind(131, "MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn")
GPS = Kind(132, "GPS", "QBBIHBcLLeff", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs")
ATT = Kind(133, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
POS = Kind(134, "POS", "QLLff", "TimeUS,Lat,Lng,Alt,RelHomeAlt")
BAT = Kind(135, "BAT", "QBfff", "TimeUS,Inst,Volt,Curr,CurrTot")
KINDS = (FMT, PARM, MSG, MODE, GPS, ATT, POS, BAT)


def us(flight: Flight) -> int:
    return round(flight.now_s * 1e6)


def beginning(flight: Flight, banner: Sequence[str]) -> bytes:
    """Returns the start of every log: its record types, the identity of the vehicle, and all its parameters."""
    now = us(flight)
    parts = [kind.described() for kind in KINDS]
    parts += [MSG.record(now, line.encode()[:64]) for line in banner]
    parts += [PARM.record(now, p.name.encode(), p.value, math.nan) for p in flight.parameters]
    return b"".join(parts) + mode(flight)


def mode(flight: Flight) -> bytes:
    return MODE.record(us(flight), int(flight.mode) & 0xFF, int(flight.mode) & 0xFF, 0)


def attitude(flight: Flight) -> bytes:
    roll, pitch, yaw = flight.body.attitude()
    degrees = (centi(math.degrees(roll)), centi(math.degrees(pitch)), centi(heading_deg(yaw)) % 36000)
    return ATT.record(us(flight), *degrees)


def position(flight: Flight) -> bytes:
    place = flight.known_place
    if place is None:
        return b""
    where = (e7(place.lat_deg), e7(place.lon_deg), place.alt_amsl_m, flight.alt_over_home_m())
    return POS.record(us(flight), *where)


def receiver(flight: Flight, unix_us: int) -> bytes:
    if not flight.estimator.gps_fix:
        return GPS.record(us(flight), 0, 1, 0, 0, 0, 9999, 0, 0, 0, 0.0, 0.0)
    body, place = flight.body, flight.place()
    gps_s = unix_us * 1e-6 - UNIX_OF_GPS_EPOCH_S + LEAP_SECONDS
    week, in_week_s = divmod(gps_s, WEEK_S)
    course = heading_deg(math.atan2(body.ve_mps, body.vn_mps))
    where = (e7(place.lat_deg), e7(place.lon_deg), centi(place.alt_amsl_m))
    return GPS.record(
        us(flight), 0, 6, int(in_week_s * 1000), int(week), 10, 121, *where, body.ground_speed_mps(), course
    )


def battery(flight: Flight) -> bytes:
    cells = flight.battery
    return BAT.record(us(flight), 0, cells.voltage_v, cells.current_a, cells.used_mah)


def texts(flight: Flight, notices: Iterable[str]) -> bytes:
    return b"".join(MSG.record(us(flight), text.encode("ascii", "replace")[:64]) for text in notices)
