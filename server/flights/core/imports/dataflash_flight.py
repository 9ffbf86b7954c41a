"""What ArduPilot's dataflash log says of a flight, as telemetry. Pure.

Names and units of the messages: ArduPilot, libraries/AP_Logger/LogStructure.h and those of the libraries that write
them. Names and units changed over the years; each taker says what older logs have. What has no place in MAVLink's
telemetry stays in the log.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from typing import IO, Final

from server.flights.core.imports.converted import Converted, converted
from server.flights.core.imports.dataflash import Buffer, DataflashReader, Record
from server.flights.core.imports.dataflash_beginning import (
    FIX_3D,
    Fields,
    arms_in,
    beginning_of,
    log_time_us,
    mode_number,
    number,
    whole,
)
from server.flights.core.imports.telemetry_writer import Airframe, TelemetryWriter
from wire.dialect import mavlink

_MAX_WAITING: Final = 64


def convert_dataflash(log: Buffer, out: IO[bytes], *, uploaded_us: int, max_bytes: int) -> Converted:
    """Raises BadFlightFile."""
    seen = beginning_of(log)
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
        at_us = log_time_us(name, fields)
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


def _is_first(fields: Fields, *names: str) -> bool:
    """Of several sensors of a kind, the first one: older logs give it no number."""
    return not any(number(fields, name) for name in names)


def _attitude(flight: _Flight, fields: Fields) -> None:
    roll, pitch, yaw = (math.radians(number(fields, name, math.nan)) for name in ("Roll", "Pitch", "Yaw"))
    flight.yaw_deg = math.degrees(yaw) if math.isfinite(yaw) else None
    flight.active_filter = whole(fields, "AEKF")
    flight.writer.attitude((roll, pitch, yaw), flight.rates_rad_s)


def _gyro(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "I"):
        flight.rates_rad_s = number(fields, "GyrX"), number(fields, "GyrY"), number(fields, "GyrZ")


def _estimate(kalman: int) -> Callable[[_Flight, Fields], None]:
    """Of an extended Kalman filter. Until Copter 3.6 a message tells of its first core only."""

    def take(flight: _Flight, fields: Fields) -> None:
        if flight.active_filter in (2, 3) and flight.active_filter != kalman:
            return
        if "C" in fields and fields["C"] != flight.primary.get(kalman, 0):
            return
        ned = number(fields, "VN"), number(fields, "VE"), number(fields, "VD")
        flight.ned_m_s = ned if all(map(math.isfinite, ned)) else flight.ned_m_s

    return take


def _primary(kalman: int) -> Callable[[_Flight, Fields], None]:
    def take(flight: _Flight, fields: Fields) -> None:
        if "C" in fields and "PI" in fields:
            flight.primary[kalman] = max(whole(fields, "PI"), 0)

    return take


def _position(flight: _Flight, fields: Fields) -> None:
    flight.has_position = True
    height = number(fields, "RelHomeAlt", number(fields, "RelAlt"))
    flight.place(number(fields, "Lat"), number(fields, "Lng"), number(fields, "Alt"), height)


def _gps(flight: _Flight, fields: Fields) -> None:
    if not _is_first(fields, "I"):
        return
    lat_deg, lon_deg, msl_m = number(fields, "Lat"), number(fields, "Lng"), number(fields, "Alt")
    speed, course = number(fields, "Spd"), number(fields, "GCrs")
    north, east = speed * math.cos(math.radians(course)), speed * math.sin(math.radians(course))
    flight.gps_ned_m_s = north, east, number(fields, "VZ")
    fix = whole(fields, "Status")
    flight.writer.gps(
        fix=fix,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        msl_m=msl_m,
        hdop=number(fields, "HDop", 655.35),
        ground_m_s=speed,
        course_deg=course,
        satellites=whole(fields, "NSats"),
    )
    if fix < FIX_3D or flight.has_position:
        return
    flight.ground_m = msl_m if flight.ground_m is None else flight.ground_m
    above_m = number(fields, "RAlt", number(fields, "RelAlt", msl_m - flight.ground_m))
    flight.place(lat_deg, lon_deg, msl_m, above_m)


def _battery(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "Inst", "Instance"):
        percent = number(fields, "RemPct", math.nan)
        amperes = number(fields, "Curr") if "Curr" in fields else None
        flight.writer.battery(volts=number(fields, "Volt"), amperes=amperes, percent=percent)


def _current(flight: _Flight, fields: Fields) -> None:
    """The battery until Plane 3.8 and Copter 3.5; in hundredths where the numbers are whole ones."""
    scale = 100 if isinstance(fields.get("Volt"), int) else 1
    if _is_first(fields, "Instance"):
        volts, amperes = number(fields, "Volt") / scale, number(fields, "Curr") / scale
        flight.writer.battery(volts=volts, amperes=amperes, percent=None)


def _mode(flight: _Flight, fields: Fields) -> None:
    flight.writer.mode(mode_number(fields))


def _arming(name: str) -> Callable[[_Flight, Fields], None]:
    def take(flight: _Flight, fields: Fields) -> None:
        arms = arms_in(name, fields)
        if arms is not None:
            flight.writer.armed(arms)

    return take


_TEXT_BYTES: Final = 64


def _text(flight: _Flight, fields: Fields) -> None:
    """Since 4.7 a longer text goes on in the next messages, with the same ID and a growing Seq."""
    text, text_id = str(fields.get("Message", "")), whole(fields, "ID", -1)
    if text_id != flight.text_id or whole(fields, "Seq") == 0:
        flight.flush_text()
    flight.text, flight.text_id = flight.text + text, text_id
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
    names = (f"{label}{channel}" for channel in range(1, 19) for label in ("C", "Ch", "Chan"))
    return [whole(fields, name) for name in names if name in fields]


def _vibration(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "IMU"):
        clips = whole(fields, "Clip", whole(fields, "Clip0"))
        levels = number(fields, "VibeX"), number(fields, "VibeY"), number(fields, "VibeZ")
        flight.writer.vibration(levels, (clips, whole(fields, "Clip1"), whole(fields, "Clip2")))


def _control(flight: _Flight, fields: Fields) -> None:
    """Throttle is 0 to 1 for a copter (0 to 1000 until Copter 3.3), and in percent for plane and rover."""
    if "NavRoll" in fields or "Steer" in fields:
        flight.throttle = number(fields, "ThO", number(fields, "ThrOut")) / 100
    else:
        flight.throttle = number(fields, "ThO", number(fields, "ThrOut") / 1000)
    if "As" in fields and not flight.has_pitot:
        flight.air_m_s = number(fields, "As")


def _rover_throttle(flight: _Flight, fields: Fields) -> None:
    flight.throttle = abs(number(fields, "ThrOut")) / 100


def _airspeed(flight: _Flight, fields: Fields) -> None:
    if _is_first(fields, "I"):
        flight.has_pitot = True
        flight.air_m_s = number(fields, "Airspeed")


_HOME: Final = 1


def _origin(flight: _Flight, fields: Fields) -> None:
    if number(fields, "Type") == _HOME:
        flight.writer.home(number(fields, "Lat"), number(fields, "Lng"), number(fields, "Alt"))


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
