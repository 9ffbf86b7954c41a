"""What must be known of a dataflash log before its first frame is written, and how its fields are read. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, NamedTuple

from server.flights.core.imports.dataflash import Buffer, DataflashReader, Value
from wire.dialect import mavlink

_GPS_EPOCH_S: Final = 315_964_800
_WEEK_S: Final = 7 * 86_400
LEAP_SECONDS: Final = ((1_483_228_800, 18), (1_435_708_800, 17), (1_341_100_800, 16), (0, 15))
"""From which second since 1970 GPS time has been ahead of UTC by how many: since 2017, July 2015, July 2012."""
_MAX_US: Final = 2**62
FIX_3D: Final = 3
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


Fields = Mapping[str, Value]


def number(fields: Fields, name: str, otherwise: float = 0.0) -> float:
    """`otherwise` for a field that is not there, or a text."""
    value = fields.get(name, otherwise)
    return otherwise if isinstance(value, str) else value


def whole(fields: Fields, name: str, otherwise: int = 0) -> int:
    """0 for what is no number, or none that a time can be."""
    value = number(fields, name, otherwise)
    return int(value) if math.isfinite(value) and abs(value) < _MAX_US else 0


def mode_number(fields: Fields) -> int:
    """Of MODE: logs until Copter 3.2 have it as Mode only."""
    return whole(fields, "ModeNum", whole(fields, "Mode"))


def arms_in(name: str, fields: Fields) -> bool | None:
    """None: an event of another kind. Older logs have no ARM."""
    if name == "ARM":
        return number(fields, "ArmState") != 0
    event = fields.get("Id")
    return event == _EV_ARMED if event in (_EV_ARMED, _EV_DISARMED) else None


class Beginning(NamedTuple):
    """What is to be known before the first frame. `base_us`: what added to the log's times gives microseconds since
    1970; None: no GPS and no clock. `is_armed`: the log begins armed."""

    base_us: int | None
    vehicle_type: int
    mode: int
    is_armed: bool


def beginning_of(log: Buffer) -> Beginning:
    """Reads the log until all is known. A log that begins at arming has no word of it: the first is of disarming."""
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
            clock_us = whole(fields, "Epoch") - whole(fields, "TimeUS")
        elif name == "MODE" and mode is None:
            mode = mode_number(fields)
        elif name in ("ARM", "EV") and first_arms is None:
            first_arms = arms_in(name, fields)
        if base_us is not None and vehicle_type is not None and mode is not None and first_arms is not None:
            break
    return Beginning(
        clock_us if base_us is None else base_us,
        mavlink.MAV_TYPE_QUADROTOR if vehicle_type is None else vehicle_type,
        mode or 0,
        first_arms is False,
    )


def _gps_base_us(fields: Fields) -> int | None:
    """Until Copter 3.2 the week is called Week, and its milliseconds TimeMS."""
    week = whole(fields, "GWk", whole(fields, "Week"))
    at_us = log_time_us("GPS", fields)
    if number(fields, "Status") < FIX_3D or week <= 0 or at_us is None:
        return None
    gps_s = _GPS_EPOCH_S + week * _WEEK_S
    ahead_s = next(ahead_s for since_s, ahead_s in LEAP_SECONDS if gps_s >= since_s)
    milliseconds = whole(fields, "GMS", whole(fields, "TimeMS"))
    return (gps_s - ahead_s) * 1_000_000 + milliseconds * 1000 - at_us


def log_time_us(name: str, fields: Fields) -> int | None:
    """Since boot. Until Copter 3.2 in milliseconds, which GPS calls T; MODE, EV and MSG have no time."""
    if "TimeUS" in fields:
        return whole(fields, "TimeUS")
    label = "T" if name == "GPS" else "TimeMS"
    return whole(fields, label) * 1000 if label in fields else None
