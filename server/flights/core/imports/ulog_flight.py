"""What PX4's log says of a flight, as telemetry. Pure.

Topics and their units: PX4-Autopilot, `msg/*.msg`; modes: `src/modules/commander/px4_custom_mode.h`. What has no place
in MAVLink's telemetry stays in the log.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import IO, Any, Final

from server.flights.core.imports.converted import Converted, converted
from server.flights.core.imports.telemetry_writer import MAX_FLIGHT_US, Airframe, TelemetryWriter
from server.flights.core.imports.ulog import LOGGED, Buffer, UlogReader
from wire.dialect import mavlink

_ARMED: Final = 2
_FIX_3D: Final = 3
_GPS_TOPICS: Final = frozenset({"vehicle_gps_position", "sensor_gps"})
_YEAR_2001_US: Final = 978_307_200_000_000
_YEAR_2100_US: Final = 4_102_444_800_000_000

MODES: Final[Mapping[int, tuple[int, int]]] = {
    0: (1, 0),  # manual
    1: (2, 0),  # altitude
    2: (3, 0),  # position
    3: (4, 4),  # mission
    4: (4, 3),  # hold
    5: (4, 5),  # return
    6: (3, 2),  # position, slow
    10: (5, 0),  # acro
    12: (4, 6),  # descend: as landing
    13: (1, 0),  # termination
    14: (6, 0),  # offboard
    15: (7, 0),  # stabilized
    17: (4, 2),  # take-off
    18: (4, 6),  # land
    19: (4, 8),  # follow target
    20: (4, 9),  # precision landing
    21: (3, 1),  # orbit
    22: (4, 10),  # VTOL take-off
    **{23 + number: (4, 11 + number) for number in range(8)},  # modes of external programs
}
"""`nav_state` to main mode and sub mode of the heartbeat."""


def convert_ulog(log: Buffer, out: IO[bytes], *, uploaded_us: int, max_bytes: int) -> Converted:
    """Raises BadFlightFile."""
    base_us, status = _look(log)
    vehicle_type = _whole_number(status, "system_type") & 0xFF or mavlink.MAV_TYPE_QUADROTOR
    airframe = Airframe(vehicle_type, mavlink.MAV_AUTOPILOT_PX4)
    known = base_us is not None
    writer = TelemetryWriter(out, airframe, base_us=uploaded_us if base_us is None else base_us, max_bytes=max_bytes)
    writer.begin(custom_mode=_mode(status), is_armed=status.get("arming_state") == _ARMED)
    flight = _Flight(writer)
    reader = UlogReader(log, frozenset(_TAKERS))
    for record in reader:
        before_us = reader.began_us - record.at_us
        # what was said long before the log began, as the place of home, holds from its beginning
        at_us = reader.began_us if 0 < before_us < MAX_FLIGHT_US else record.at_us
        if record.instance == 0 and writer.at(at_us):
            _TAKERS[record.name](flight, record.fields)
    return converted(writer, "ulog", clock_known=known, skipped_bytes=reader.skipped)


def _look(log: Buffer) -> tuple[int | None, Fields]:
    """What added to the log's times gives microseconds since 1970 (None: no GPS had the time), and the first status."""
    base_us: int | None = None
    status: Fields | None = None
    for record in UlogReader(log, _GPS_TOPICS | {"vehicle_status"}):
        if record.name == "vehicle_status" and status is None:
            status = record.fields
        elif record.name in _GPS_TOPICS and base_us is None and _whole_number(record.fields, "fix_type") >= _FIX_3D:
            utc_us = _whole_number(record.fields, "time_utc_usec")
            told_us = record.at_us + _whole_number(record.fields, "timestamp_time_relative")
            base_us = utc_us - told_us if _YEAR_2001_US < utc_us < _YEAR_2100_US else None
        if base_us is not None and status is not None:
            break
    return base_us, status or {}


def _mode(status: Fields) -> int:
    """For the heartbeat."""
    main, sub = MODES.get(_whole_number(status, "nav_state"), (0, 0))
    return main << 16 | sub << 24


def _whole_number(fields: Fields, name: str) -> int:
    """0 for what is none."""
    value = fields.get(name)
    return value if isinstance(value, int) else 0


class _Flight:
    """What is known so far, where a message of MAVLink needs more than one of the log."""

    def __init__(self, writer: TelemetryWriter) -> None:
        self.writer = writer
        self.rates_rad_s = 0.0, 0.0, 0.0
        self.ned_m_s = 0.0, 0.0, 0.0
        self.yaw_rad: float | None = None
        self.air_m_s = 0.0
        self.throttle = 0.0
        self.has_global = self.has_local = self.has_selected_gps = False
        self.ground_m: float | None = None
        """The first height of the GPS, for logs without an estimated position."""
        self.home_msl_m: float | None = None
        self.down_m: float | None = None


Fields = Mapping[str, Any]


_METRES_PER_DEGREE: Final = math.radians(1) * 6_371_000


def _rates(flight: _Flight, fields: Fields) -> None:
    x, y, z = fields["xyz"]
    flight.rates_rad_s = x, y, z


def _attitude(flight: _Flight, fields: Fields) -> None:
    w, x, y, z = fields["q"]
    if "rollspeed" in fields:  # until PX4 1.8
        flight.rates_rad_s = fields["rollspeed"], fields["pitchspeed"], fields["yawspeed"]
    if not all(map(math.isfinite, (w, x, y, z))):
        return
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(min(1.0, max(-1.0, 2 * (w * y - z * x))))
    flight.yaw_rad = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    flight.writer.attitude((roll, pitch, flight.yaw_rad), flight.rates_rad_s)


def _local(flight: _Flight, fields: Fields) -> None:
    ned = fields["vx"], fields["vy"], fields["vz"]
    flight.ned_m_s = ned if all(map(math.isfinite, ned)) else flight.ned_m_s
    flight.down_m = fields["z"] if math.isfinite(fields["z"]) else None
    if not flight.has_global and fields.get("xy_global") and fields.get("z_global"):
        flight.has_local = True
        lat = fields["ref_lat"] + fields["x"] / _METRES_PER_DEGREE
        lon = fields["ref_lon"] + fields["y"] / (_METRES_PER_DEGREE * math.cos(math.radians(fields["ref_lat"])))
        _place(flight, lat, lon, fields["ref_alt"] - fields["z"])


def _global(flight: _Flight, fields: Fields) -> None:
    """Since PX4 1.16 with flags that say whether the estimate holds."""
    if fields.get("lat_lon_valid", True) and fields.get("alt_valid", True):
        flight.has_global = True
        _place(flight, fields["lat"], fields["lon"], fields["alt"])


def _place(flight: _Flight, lat_deg: float, lon_deg: float, msl_m: float) -> None:
    if flight.home_msl_m is not None:
        rel_m = msl_m - flight.home_msl_m
    else:
        rel_m = msl_m - (flight.ground_m or msl_m) if flight.down_m is None else -flight.down_m
    heading_deg = None if flight.yaw_rad is None else math.degrees(flight.yaw_rad)
    ned = flight.ned_m_s
    flight.writer.position(lat_deg, lon_deg, msl_m=msl_m, rel_m=rel_m, ned_m_s=ned, heading_deg=heading_deg)
    flight.writer.flight_display(
        air_m_s=flight.air_m_s,
        ground_m_s=math.hypot(ned[0], ned[1]),
        heading_deg=heading_deg or 0.0,
        throttle=flight.throttle,
        msl_m=msl_m,
        climb_m_s=-ned[2],
    )


def _selected_gps(flight: _Flight, fields: Fields) -> None:
    """What PX4 makes of its receivers; `sensor_gps` is one of them."""
    flight.has_selected_gps = True
    _gps(flight, fields)


def _sensor_gps(flight: _Flight, fields: Fields) -> None:
    if not flight.has_selected_gps:
        _gps(flight, fields)


def _gps(flight: _Flight, fields: Fields) -> None:
    """`lat`, `lon` and `alt` are whole numbers (degrees times 10^7, millimetres) up to PX4 1.14."""
    if "latitude_deg" in fields:
        place = fields["latitude_deg"], fields["longitude_deg"], fields["altitude_msl_m"]
    else:
        place = fields["lat"] / 1e7, fields["lon"] / 1e7, fields["alt"] / 1000
    flight.writer.gps(
        fix=fields["fix_type"],
        lat_deg=place[0],
        lon_deg=place[1],
        msl_m=place[2],
        hdop=fields["hdop"],
        ground_m_s=fields["vel_m_s"],
        course_deg=math.degrees(fields["cog_rad"]),
        satellites=fields["satellites_used"],
    )
    if fields["fix_type"] >= _FIX_3D and not flight.has_global and not flight.has_local:
        flight.ground_m = place[2] if flight.ground_m is None else flight.ground_m
        _place(flight, *place)


def _battery(flight: _Flight, fields: Fields) -> None:
    """-1: not known."""
    amperes, remaining = fields["current_a"], fields["remaining"]
    flight.writer.battery(
        volts=fields["voltage_v"],
        amperes=None if amperes < 0 else amperes,
        percent=None if remaining < 0 else 100 * remaining,
    )


def _thrust(flight: _Flight, fields: Fields) -> None:
    """Up for a copter, forward for a plane. `actuator_controls_0` had it until PX4 1.13."""
    if "control" in fields:
        flight.throttle = fields["control"][3]
    else:
        forward, _, down = fields["xyz"]
        flight.throttle = max(forward, -down)


def _status(flight: _Flight, fields: Fields) -> None:
    flight.writer.mode(_mode(fields))
    flight.writer.armed(fields["arming_state"] == _ARMED)


def _home(flight: _Flight, fields: Fields) -> None:
    """A height may be known before the place is."""
    if not math.isfinite(fields["alt"]) or not fields.get("valid_alt", True):
        return
    flight.home_msl_m = fields["alt"]
    if fields.get("valid_hpos", True):
        flight.writer.home(fields["lat"], fields["lon"], fields["alt"])


def _receiver(flight: _Flight, fields: Fields) -> None:
    flight.writer.receiver(list(fields["values"])[: fields["channel_count"]])


def _outputs(flight: _Flight, fields: Fields) -> None:
    pulses = [round(one) if math.isfinite(one) else 0 for one in fields["output"]]
    flight.writer.servos(pulses[: fields["noutputs"]])


def _airspeed(flight: _Flight, fields: Fields) -> None:
    speed = fields["true_airspeed_m_s"]
    flight.air_m_s = speed if math.isfinite(speed) else 0.0


def _landed(flight: _Flight, fields: Fields) -> None:
    flight.writer.landed(bool(fields["landed"]))


def _text(flight: _Flight, fields: Fields) -> None:
    flight.writer.text(fields["level"], fields["message"])


def _whole(taker: Callable[[_Flight, Fields], None]) -> Callable[[_Flight, Fields], None]:
    """Leaves out a message of another version, which lacks a field."""

    def take(flight: _Flight, fields: Fields) -> None:
        try:
            taker(flight, fields)
        except (KeyError, IndexError, TypeError, ValueError, OverflowError):
            return

    return take


_TAKERS: Final[Mapping[str, Callable[[_Flight, Fields], None]]] = {
    name: _whole(taker)
    for name, taker in {
        "vehicle_angular_velocity": _rates,
        "vehicle_attitude": _attitude,
        "vehicle_local_position": _local,
        "vehicle_global_position": _global,
        "vehicle_gps_position": _selected_gps,
        "sensor_gps": _sensor_gps,
        "vehicle_thrust_setpoint": _thrust,
        "actuator_controls_0": _thrust,
        "battery_status": _battery,
        "vehicle_status": _status,
        "home_position": _home,
        "input_rc": _receiver,
        "actuator_outputs": _outputs,
        "airspeed_validated": _airspeed,
        "vehicle_land_detected": _landed,
        LOGGED: _text,
    }.items()
}
