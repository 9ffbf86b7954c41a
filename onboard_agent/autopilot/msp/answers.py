"""What a flight controller answers by MSP, as plain values. Pure.

Functions and layouts are those of Betaflight's and INAV's `msp.c`. An answer that is too short is None: older firmware
lacks fields at the end, and those have a default here.
"""

from __future__ import annotations

from struct import Struct, unpack_from
from typing import Final, NamedTuple

API_VERSION: Final = 1
FC_VARIANT: Final = 2
FC_VERSION: Final = 3
MODE_RANGES: Final = 34
RX_MAP: Final = 64
STATUS: Final = 101
RC: Final = 105
RAW_GPS: Final = 106
ATTITUDE: Final = 108
ALTITUDE: Final = 109
ANALOG: Final = 110
BOX_NAMES: Final = 116
BOX_IDS: Final = 119
SET_RAW_RC: Final = 200

_STATUS: Final = Struct("<HHHI")
_GPS: Final = Struct("<BBiiHHH")
_ATTITUDE: Final = Struct("<3h")
_ALTITUDE: Final = Struct("<ih")
_ANALOG: Final = Struct("<BHHh")
MAX_CHANNELS: Final = 18


class Status(NamedTuple):
    """`flags`: bit n is the n-th box of BOX_NAMES. `sensors`: bit 0 accelerometer, 1 barometer, 2 compass, 3 GPS."""

    sensors: int
    flags: int


class Gps(NamedTuple):
    """`fix`: 0 none. Degrees times 10^7, metres above the sea, cm/s, tenths of a degree."""

    fix: int
    satellites: int
    lat_e7: int
    lon_e7: int
    altitude_m: int
    speed_cm_s: int
    course_ddeg: int


class Attitude(NamedTuple):
    """Degrees, with MAVLink's signs: nose up is positive."""

    roll_deg: float
    pitch_deg: float
    yaw_deg: float


class Altitude(NamedTuple):
    """Above the place of arming."""

    height_m: float
    climb_m_s: float


class Analog(NamedTuple):
    voltage_v: float
    used_mah: int
    rssi: int
    current_a: float


class ModeRange(NamedTuple):
    """A box is active while this auxiliary channel (0 is the fifth) has a pulse in this range, in microseconds."""

    box_id: int
    channel: int
    low_us: int
    high_us: int


def status(data: bytes) -> Status | None:
    if len(data) < _STATUS.size:
        return None
    _, _, sensors, flags = _STATUS.unpack_from(data)
    return Status(sensors, flags)


def gps(data: bytes) -> Gps | None:
    return Gps(*_GPS.unpack_from(data)) if len(data) >= _GPS.size else None


def attitude(data: bytes) -> Attitude | None:
    if len(data) < _ATTITUDE.size:
        return None
    roll, pitch, yaw = _ATTITUDE.unpack_from(data)
    return Attitude(roll / 10, -pitch / 10, yaw % 360)


def altitude(data: bytes) -> Altitude | None:
    if len(data) < _ALTITUDE.size:
        return None
    height_cm, climb_cm_s = _ALTITUDE.unpack_from(data)
    return Altitude(height_cm / 100, climb_cm_s / 100)


def analog(data: bytes) -> Analog | None:
    """The voltage in hundredths, where the firmware has it, is finer than the one in tenths."""
    if len(data) < _ANALOG.size:
        return None
    tenths, used_mah, rssi, hundredths_a = _ANALOG.unpack_from(data)
    fine = unpack_from("<H", data, _ANALOG.size)[0] / 100 if len(data) >= _ANALOG.size + 2 else tenths / 10
    return Analog(fine, used_mah, rssi, hundredths_a / 100)


def channels(data: bytes) -> tuple[int, ...]:
    """Pulses in microseconds: roll, pitch, yaw, throttle, auxiliary channels."""
    count = min(len(data) // 2, MAX_CHANNELS)
    return unpack_from(f"<{count}H", data)


def box_names(data: bytes) -> tuple[str, ...]:
    return tuple(name.strip() for name in data.decode("ascii", "replace").split(";") if name.strip())


def mode_ranges(data: bytes) -> tuple[ModeRange, ...]:
    """Without the rows that are not in use."""
    rows = (data[start : start + 4] for start in range(0, len(data) - 3, 4))
    return tuple(ModeRange(box, aux, 900 + 25 * low, 900 + 25 * high) for box, aux, low, high in rows if high > low)
