"""What ArduPilot's dataflash log says of a flight, as telemetry. Pure.

Names and units of the messages: ArduPilot, libraries/AP_Logger/LogStructure.h and those of the libraries that write
them. What has no place in MAVLink's telemetry stays in the log.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import IO, Final

from server.live.flight_imports.converted import Converted, converted
from server.live.flight_imports.dataflash import Buffer, DataflashReader, Record, Value
from server.live.flight_imports.telemetry_writer import Airframe, TelemetryWriter
from wire.dialect import mavlink

_GPS_EPOCH_S: Final = 315_964_800
_WEEK_S: Final = 7 * 86_400
LEAP_S: Final = 18
"""GPS time is ahead of UTC by so much since 2017."""
_FIX_3D: Final = 3
_EV_ARMED, _EV_DISARMED = 10, 11
_TYPES: Final[Mapping[str, int]] = {
    "ArduCopter": mavlink.MAV_TYPE_QUADROTOR,
    "APM:Copter": mavlink.MAV_TYPE_QUADROTOR,
    "ArduPlane": mavlink.MAV_TYPE_FIXED_WING,
    "ArduRover": mavlink.MAV_TYPE_GROUND_ROVER,
    "ArduSub": mavlink.MAV_TYPE_SUBMARINE,
    "Blimp": mavlink.MAV_TYPE_AIRSHIP,
    "AntennaTracker": mavlink.MAV_TYPE_ANTENNA_TRACKER,
}
"""By the beginning of the text with which the log names its firmware."""


def convert_dataflash(log: Buffer, out: IO[bytes], *, uploaded_us: int, max_bytes: int) -> Converted:
    """Raises BadFlightFile."""
    base_us, vehicle_type = _look(log)
    airframe = Airframe(vehicle_type, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)
    known = base_us is not None
    writer = TelemetryWriter(out, airframe, base_us=uploaded_us if base_us is None else base_us, max_bytes=max_bytes)
    flight = _Flight(writer)
    reader = DataflashReader(log, frozenset(_TAKERS))
    for record in reader:
        flight.take(record)
    return converted(writer, "dataflash", clock_known=known, skipped_bytes=reader.skipped)


def _look(log: Buffer) -> tuple[int | None, int]:
    """What added to the log's times gives microseconds since 1970 (None: no GPS had the time), and the MAV_TYPE."""
    base_us: int | None = None
    vehicle_type: int | None = None
    for name, fields in DataflashReader(log, frozenset({"GPS", "MSG"})):
        if name == "MSG" and vehicle_type is None:
            text = str(fields.get("Message", ""))
            vehicle_type = next((kind for start, kind in _TYPES.items() if text.startswith(start)), None)
        if name == "GPS" and _number(fields, "Status") >= _FIX_3D and _number(fields, "GWk") > 0 and base_us is None:
            second = _GPS_EPOCH_S + _number(fields, "GWk") * _WEEK_S + _number(fields, "GMS") / 1000 - LEAP_S
            base_us = round(second * 1e6) - int(_number(fields, "TimeUS"))
        if base_us is not None and vehicle_type is not None:
            break
    return base_us, mavlink.MAV_TYPE_QUADROTOR if vehicle_type is None else vehicle_type


class _Flight:
    """What is known so far, where a message of MAVLink needs more than one of the log."""

    def __init__(self, writer: TelemetryWriter) -> None:
        self.writer = writer
        self.yaw_deg: float | None = None
        self.rates_rad_s = 0.0, 0.0, 0.0
        self.ned_m_s: tuple[float, float, float] | None = None
        """Of the estimator; None: as yet of the GPS only."""
        self.gps_ned_m_s = 0.0, 0.0, 0.0
        self.air_m_s = 0.0
        self.throttle = 0.0
        self.ground_m: float | None = None
        """The first height of the GPS, for logs without an estimated position."""
        self.has_position = False

    def take(self, record: Record) -> None:
        name, fields = record
        if "TimeUS" in fields and self.writer.at(int(_number(fields, "TimeUS"))):
            _TAKERS[name](self, fields)

    def place(self, lat_deg: float, lon_deg: float, msl_m: float, rel_m: float) -> None:
        ned = self.gps_ned_m_s if self.ned_m_s is None else self.ned_m_s
        ground_m_s = math.hypot(ned[0], ned[1])
        at = {"msl_m": msl_m, "rel_m": rel_m}
        self.writer.position(lat_deg, lon_deg, ned_m_s=ned, heading_deg=self.yaw_deg, **at)
        self.writer.flight_display(
            air_m_s=self.air_m_s,
            ground_m_s=ground_m_s,
            heading_deg=self.yaw_deg or 0.0,
            throttle=self.throttle,
            msl_m=msl_m,
            climb_m_s=-ned[2],
        )


Fields = Mapping[str, Value]


def _number(fields: Fields, name: str, otherwise: float = 0.0) -> float:
    value = fields.get(name, otherwise)
    return otherwise if isinstance(value, str) else value


def _is_first(fields: Fields, *names: str) -> bool:
    """Of several sensors of a kind, the first one: older logs give it no number."""
    return not any(_number(fields, name) for name in names)


def _attitude(flight: _Flight, fields: Fields) -> None:
    roll, pitch, yaw = (math.radians(_number(fields, name, math.nan)) for name in ("Roll", "Pitch", "Yaw"))
    flight.yaw_deg = math.degrees(yaw) if math.isfinite(yaw) else None
    flight.writer.attitude((roll, pitch, yaw), flight.rates_rad_s)


def _gyro(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "I"):
        flight.rates_rad_s = _number(fields, "GyrX"), _number(fields, "GyrY"), _number(fields, "GyrZ")


def _estimate(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "C"):
        ned = _number(fields, "VN"), _number(fields, "VE"), _number(fields, "VD")
        flight.ned_m_s = ned if all(map(math.isfinite, ned)) else flight.ned_m_s


def _position(flight: _Flight, fields: Fields) -> None:
    flight.has_position = True
    height = _number(fields, "RelHomeAlt", _number(fields, "RelAlt"))
    flight.place(_number(fields, "Lat"), _number(fields, "Lng"), _number(fields, "Alt"), height)


def _gps(flight: _Flight, fields: Fields) -> None:
    if not _is_first(fields, "I"):
        return
    lat_deg, lon_deg, msl_m = _number(fields, "Lat"), _number(fields, "Lng"), _number(fields, "Alt")
    speed, course = _number(fields, "Spd"), _number(fields, "GCrs")
    north, east = speed * math.cos(math.radians(course)), speed * math.sin(math.radians(course))
    flight.gps_ned_m_s = north, east, _number(fields, "VZ")
    fix = int(_number(fields, "Status"))
    flight.writer.gps(
        fix=fix,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        msl_m=msl_m,
        hdop=_number(fields, "HDop", 655.35),
        ground_m_s=speed,
        course_deg=course,
        satellites=int(_number(fields, "NSats")),
    )
    if fix < _FIX_3D or flight.has_position:
        return
    flight.ground_m = msl_m if flight.ground_m is None else flight.ground_m
    flight.place(lat_deg, lon_deg, msl_m, msl_m - flight.ground_m)


def _battery(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "Inst", "Instance"):
        percent = _number(fields, "RemPct", math.nan)
        amperes = _number(fields, "Curr") if "Curr" in fields else None
        flight.writer.battery(volts=_number(fields, "Volt"), amperes=amperes, percent=percent)


def _mode(flight: _Flight, fields: Fields) -> None:
    flight.writer.mode(int(_number(fields, "ModeNum", _number(fields, "Mode"))))


def _arming(flight: _Flight, fields: Fields) -> None:
    flight.writer.armed(_number(fields, "ArmState") != 0)


def _event(flight: _Flight, fields: Fields) -> None:
    """Older logs have no ARM."""
    if fields.get("Id") in (_EV_ARMED, _EV_DISARMED):
        flight.writer.armed(fields["Id"] == _EV_ARMED)


def _text(flight: _Flight, fields: Fields) -> None:
    """The log does not keep the severity."""
    flight.writer.text(mavlink.MAV_SEVERITY_INFO, str(fields.get("Message", "")))


def _receiver(flight: _Flight, fields: Fields) -> None:
    flight.writer.receiver(_channels(fields))


def _servos(flight: _Flight, fields: Fields) -> None:
    flight.writer.servos(_channels(fields))


def _channels(fields: Fields) -> list[int]:
    names = (f"C{number}" for number in range(1, 17))
    return [int(_number(fields, name)) for name in names if name in fields]


def _vibration(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "IMU"):
        clips = int(_number(fields, "Clip", _number(fields, "Clip0")))
        levels = _number(fields, "VibeX"), _number(fields, "VibeY"), _number(fields, "VibeZ")
        flight.writer.vibration(levels, (clips, int(_number(fields, "Clip1")), int(_number(fields, "Clip2"))))


def _control(flight: _Flight, fields: Fields) -> None:
    flight.throttle = _number(fields, "ThO")


def _airspeed(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "I"):
        flight.air_m_s = _number(fields, "Airspeed")


_HOME: Final = 1


def _origin(flight: _Flight, fields: Fields) -> None:
    if _number(fields, "Type") == _HOME:
        flight.writer.home(_number(fields, "Lat"), _number(fields, "Lng"), _number(fields, "Alt"))


_TAKERS: Final[Mapping[str, Callable[[_Flight, Fields], None]]] = {
    "ATT": _attitude,
    "IMU": _gyro,
    "XKF1": _estimate,
    "NKF1": _estimate,
    "POS": _position,
    "GPS": _gps,
    "BAT": _battery,
    "MODE": _mode,
    "ARM": _arming,
    "EV": _event,
    "MSG": _text,
    "RCIN": _receiver,
    "RCOU": _servos,
    "VIBE": _vibration,
    "CTUN": _control,
    "ARSP": _airspeed,
    "ORGN": _origin,
}
