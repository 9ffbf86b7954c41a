"""What ArduPilot's dataflash log says of a flight, as telemetry. Pure.

Names and units of the messages: ArduPilot, libraries/AP_Logger/LogStructure.h and those of the libraries that write
them. Names and units changed over the years; each taker says what older logs have. What has no place in MAVLink's
telemetry stays in the log.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from typing import IO, Final, NamedTuple

from server.live.flight_imports.converted import Converted, converted
from server.live.flight_imports.dataflash import Buffer, DataflashReader, Record, Value
from server.live.flight_imports.telemetry_writer import Airframe, TelemetryWriter
from wire.dialect import mavlink

_GPS_EPOCH_S: Final = 315_964_800
_WEEK_S: Final = 7 * 86_400
LEAP_SECONDS: Final = ((1_483_228_800, 18), (1_435_708_800, 17), (1_341_100_800, 16), (0, 15))
"""From which second since 1970 GPS time has been ahead of UTC by how many: since 2017, July 2015, July 2012."""
_MAX_WAITING: Final = 64
_MAX_US: Final = 2**62
_FIX_3D: Final = 3
_EV_ARMED, _EV_DISARMED = 10, 11
_TYPES: Final[Mapping[str, int]] = {
    "ArduCopter": mavlink.MAV_TYPE_QUADROTOR,
    "APM:Copter": mavlink.MAV_TYPE_QUADROTOR,
    "ArduPlane": mavlink.MAV_TYPE_FIXED_WING,
    "APM:Plane": mavlink.MAV_TYPE_FIXED_WING,
    "ArduRover": mavlink.MAV_TYPE_GROUND_ROVER,
    "APM:Rover": mavlink.MAV_TYPE_GROUND_ROVER,
    "ArduSub": mavlink.MAV_TYPE_SUBMARINE,
    "Blimp": mavlink.MAV_TYPE_AIRSHIP,
    "AntennaTracker": mavlink.MAV_TYPE_ANTENNA_TRACKER,
}
"""By the beginning of the text with which the log names its firmware."""


def convert_dataflash(log: Buffer, out: IO[bytes], *, uploaded_us: int, max_bytes: int) -> Converted:
    """Raises BadFlightFile."""
    seen = _look(log)
    airframe = Airframe(seen.vehicle_type, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)
    known = seen.base_us is not None
    base_us = uploaded_us if seen.base_us is None else seen.base_us
    writer = TelemetryWriter(out, airframe, base_us=base_us, max_bytes=max_bytes)
    writer.begin(custom_mode=seen.mode, is_armed=seen.is_armed)
    flight = _Flight(writer)
    reader = DataflashReader(log, frozenset(_TAKERS))
    for record in reader:
        flight.take(record)
    flight.flush_text()
    return converted(writer, "dataflash", clock_known=known, skipped_bytes=reader.skipped)


class _Seen(NamedTuple):
    """What is to be known before the first frame. `base_us`: what added to the log's times gives microseconds since
    1970; None: no GPS and no clock. `is_armed`: the log begins armed."""

    base_us: int | None
    vehicle_type: int
    mode: int
    is_armed: bool


def _look(log: Buffer) -> _Seen:
    """A log that begins at arming has no word of it: the first is of disarming."""
    base_us: int | None = None
    clock_us: int | None = None
    vehicle_type: int | None = None
    mode: int | None = None
    first_arms: bool | None = None
    for name, fields in DataflashReader(log, frozenset({"GPS", "MSG", "RTC", "MODE", "ARM", "EV"})):
        if name == "MSG" and vehicle_type is None:
            text = str(fields.get("Message", ""))
            vehicle_type = next((kind for start, kind in _TYPES.items() if text.startswith(start)), None)
        elif name == "GPS" and base_us is None:
            base_us = _gps_base_us(fields)
        elif name == "RTC" and clock_us is None:
            clock_us = _whole(fields, "Epoch") - _whole(fields, "TimeUS")
        elif name == "MODE" and mode is None:
            mode = _mode_number(fields)
        elif name in ("ARM", "EV") and first_arms is None:
            first_arms = _arms(name, fields)
        if base_us is not None and vehicle_type is not None and mode is not None and first_arms is not None:
            break
    return _Seen(
        clock_us if base_us is None else base_us,
        mavlink.MAV_TYPE_QUADROTOR if vehicle_type is None else vehicle_type,
        mode or 0,
        first_arms is False,
    )


def _gps_base_us(fields: Fields) -> int | None:
    """Until Copter 3.2 the week is called Week, and its milliseconds TimeMS."""
    week = _whole(fields, "GWk", _whole(fields, "Week"))
    at_us = _log_time_us("GPS", fields)
    if _number(fields, "Status") < _FIX_3D or week <= 0 or at_us is None:
        return None
    gps_s = _GPS_EPOCH_S + week * _WEEK_S
    ahead_s = next(ahead_s for since_s, ahead_s in LEAP_SECONDS if gps_s >= since_s)
    milliseconds = _whole(fields, "GMS", _whole(fields, "TimeMS"))
    return (gps_s - ahead_s) * 1_000_000 + milliseconds * 1000 - at_us


def _log_time_us(name: str, fields: Fields) -> int | None:
    """Since boot. Until Copter 3.2 in milliseconds, which GPS calls T; MODE, EV and MSG have no time."""
    if "TimeUS" in fields:
        return _whole(fields, "TimeUS")
    label = "T" if name == "GPS" else "TimeMS"
    return _whole(fields, label) * 1000 if label in fields else None


class _Flight:
    """What is known so far, where a message of MAVLink needs more than one of the log."""

    def __init__(self, writer: TelemetryWriter) -> None:
        self.writer = writer
        self.now_us: int | None = None
        """Of the last message that had a time."""
        self.waiting: list[Record] = []
        """Messages without a time, before the first that has one."""
        self.text, self.text_id = "", -1
        """The beginning of a text that the next message may go on with, and its number."""
        self.yaw_deg: float | None = None
        self.rates_rad_s = 0.0, 0.0, 0.0
        self.active_filter = 0
        """The extended Kalman filter that flies, 2 or 3; 0: not said."""
        self.primary: dict[int, int] = {}
        """Which core of each filter is used."""
        self.ned_m_s: tuple[float, float, float] | None = None
        """Of the estimator; None: as yet of the GPS only."""
        self.gps_ned_m_s = 0.0, 0.0, 0.0
        self.air_m_s = 0.0
        self.has_pitot = False
        self.throttle = 0.0
        self.more_inputs: list[int] = []
        self.more_outputs: list[int] = []
        """Channels from 15 on, which have messages of their own."""
        self.ground_m: float | None = None
        """The first height of the GPS, for logs without an estimated position."""
        self.has_position = False

    def take(self, record: Record) -> None:
        name, fields = record
        at_us = _log_time_us(name, fields)
        if at_us is not None:
            self.now_us = at_us
        elif self.now_us is None:
            self.waiting = [*self.waiting, record][:_MAX_WAITING]
            return
        else:
            at_us = self.now_us
        if not self.writer.at(at_us):
            return
        waiting, self.waiting = self.waiting, []
        for name, fields in (*waiting, record):
            if name != "MSG":
                self.flush_text()
            try:
                _TAKERS[name](self, fields)
            except (ValueError, OverflowError, struct.error):
                continue  # a damaged message

    def flush_text(self) -> None:
        """The log does not keep the severity."""
        text, self.text, self.text_id = self.text, "", -1
        if text:
            self.writer.text(mavlink.MAV_SEVERITY_INFO, text)

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


def _whole(fields: Fields, name: str, otherwise: int = 0) -> int:
    """0 for what is no number, or none that a time can be."""
    value = _number(fields, name, otherwise)
    return int(value) if math.isfinite(value) and abs(value) < _MAX_US else 0


def _is_first(fields: Fields, *names: str) -> bool:
    """Of several sensors of a kind, the first one: older logs give it no number."""
    return not any(_number(fields, name) for name in names)


def _attitude(flight: _Flight, fields: Fields) -> None:
    roll, pitch, yaw = (math.radians(_number(fields, name, math.nan)) for name in ("Roll", "Pitch", "Yaw"))
    flight.yaw_deg = math.degrees(yaw) if math.isfinite(yaw) else None
    flight.active_filter = _whole(fields, "AEKF")
    flight.writer.attitude((roll, pitch, yaw), flight.rates_rad_s)


def _gyro(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "I"):
        flight.rates_rad_s = _number(fields, "GyrX"), _number(fields, "GyrY"), _number(fields, "GyrZ")


def _estimate(number: int) -> Callable[[_Flight, Fields], None]:
    """Of an extended Kalman filter. Until Copter 3.6 a message tells of its first core only."""

    def take(flight: _Flight, fields: Fields) -> None:
        if flight.active_filter in (2, 3) and flight.active_filter != number:
            return
        if "C" in fields and fields["C"] != flight.primary.get(number, 0):
            return
        ned = _number(fields, "VN"), _number(fields, "VE"), _number(fields, "VD")
        flight.ned_m_s = ned if all(map(math.isfinite, ned)) else flight.ned_m_s

    return take


def _primary(number: int) -> Callable[[_Flight, Fields], None]:
    def take(flight: _Flight, fields: Fields) -> None:
        if "C" in fields and "PI" in fields:
            flight.primary[number] = max(_whole(fields, "PI"), 0)

    return take


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
    fix = _whole(fields, "Status")
    flight.writer.gps(
        fix=fix,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        msl_m=msl_m,
        hdop=_number(fields, "HDop", 655.35),
        ground_m_s=speed,
        course_deg=course,
        satellites=_whole(fields, "NSats"),
    )
    if fix < _FIX_3D or flight.has_position:
        return
    flight.ground_m = msl_m if flight.ground_m is None else flight.ground_m
    above_m = _number(fields, "RAlt", _number(fields, "RelAlt", msl_m - flight.ground_m))
    flight.place(lat_deg, lon_deg, msl_m, above_m)


def _battery(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "Inst", "Instance"):
        percent = _number(fields, "RemPct", math.nan)
        amperes = _number(fields, "Curr") if "Curr" in fields else None
        flight.writer.battery(volts=_number(fields, "Volt"), amperes=amperes, percent=percent)


def _current(flight: _Flight, fields: Fields) -> None:
    """The battery until Plane 3.8 and Copter 3.5; in hundredths where the numbers are whole ones."""
    scale = 100 if isinstance(fields.get("Volt"), int) else 1
    if _is_first(fields, "Instance"):
        volts, amperes = _number(fields, "Volt") / scale, _number(fields, "Curr") / scale
        flight.writer.battery(volts=volts, amperes=amperes, percent=None)


def _mode(flight: _Flight, fields: Fields) -> None:
    flight.writer.mode(_mode_number(fields))


def _mode_number(fields: Fields) -> int:
    return _whole(fields, "ModeNum", _whole(fields, "Mode"))


def _arming(name: str) -> Callable[[_Flight, Fields], None]:
    def take(flight: _Flight, fields: Fields) -> None:
        arms = _arms(name, fields)
        if arms is not None:
            flight.writer.armed(arms)

    return take


def _arms(name: str, fields: Fields) -> bool | None:
    """None: an event of another kind. Older logs have no ARM."""
    if name == "ARM":
        return _number(fields, "ArmState") != 0
    event = fields.get("Id")
    return event == _EV_ARMED if event in (_EV_ARMED, _EV_DISARMED) else None


_TEXT_BYTES: Final = 64


def _text(flight: _Flight, fields: Fields) -> None:
    """Since 4.7 a longer text goes on in the next messages, with the same ID and a growing Seq."""
    text, number = str(fields.get("Message", "")), _whole(fields, "ID", -1)
    if number != flight.text_id or _whole(fields, "Seq") == 0:
        flight.flush_text()
    flight.text, flight.text_id = flight.text + text, number
    if "Seq" not in fields or len(text) < _TEXT_BYTES:
        flight.flush_text()


def _receiver(flight: _Flight, fields: Fields) -> None:
    flight.writer.receiver(_channels(fields) + flight.more_inputs)


def _more_inputs(flight: _Flight, fields: Fields) -> None:
    flight.more_inputs = _channels(fields)


def _servos(flight: _Flight, fields: Fields) -> None:
    flight.writer.servos(_channels(fields) + flight.more_outputs)


def _more_outputs(flight: _Flight, fields: Fields) -> None:
    flight.more_outputs = _channels(fields)


def _channels(fields: Fields) -> list[int]:
    """Outputs were called Chan1, and then Ch1, before they were called C1."""
    names = (f"{label}{number}" for number in range(1, 19) for label in ("C", "Ch", "Chan"))
    return [_whole(fields, name) for name in names if name in fields]


def _vibration(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "IMU"):
        clips = _whole(fields, "Clip", _whole(fields, "Clip0"))
        levels = _number(fields, "VibeX"), _number(fields, "VibeY"), _number(fields, "VibeZ")
        flight.writer.vibration(levels, (clips, _whole(fields, "Clip1"), _whole(fields, "Clip2")))


def _control(flight: _Flight, fields: Fields) -> None:
    """Throttle is 0 to 1 for a copter (0 to 1000 until Copter 3.3), and in percent for plane and rover."""
    if "NavRoll" in fields or "Steer" in fields:
        flight.throttle = _number(fields, "ThO", _number(fields, "ThrOut")) / 100
    else:
        flight.throttle = _number(fields, "ThO", _number(fields, "ThrOut") / 1000)
    if "As" in fields and not flight.has_pitot:
        flight.air_m_s = _number(fields, "As")


def _rover_throttle(flight: _Flight, fields: Fields) -> None:
    flight.throttle = abs(_number(fields, "ThrOut")) / 100


def _airspeed(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "I"):
        flight.has_pitot = True
        flight.air_m_s = _number(fields, "Airspeed")


_HOME: Final = 1


def _origin(flight: _Flight, fields: Fields) -> None:
    if _number(fields, "Type") == _HOME:
        flight.writer.home(_number(fields, "Lat"), _number(fields, "Lng"), _number(fields, "Alt"))


_TAKERS: Final[Mapping[str, Callable[[_Flight, Fields], None]]] = {
    "ATT": _attitude,
    "IMU": _gyro,
    "XKF1": _estimate(3),
    "XKF4": _primary(3),
    "NKF1": _estimate(2),
    "NKF4": _primary(2),
    "EKF1": _estimate(1),
    "POS": _position,
    "GPS": _gps,
    "BAT": _battery,
    "CURR": _current,
    "MODE": _mode,
    "ARM": _arming("ARM"),
    "EV": _arming("EV"),
    "MSG": _text,
    "RCIN": _receiver,
    "RCI2": _more_inputs,
    "RCOU": _servos,
    "RCO2": _more_outputs,
    "VIBE": _vibration,
    "CTUN": _control,
    "THR": _rover_throttle,
    "ARSP": _airspeed,
    "ORGN": _origin,
}
