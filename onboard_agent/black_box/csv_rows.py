"""The flight as a table: one row for each ATTITUDE of the autopilot, with the newest of everything else. No I/O.

A row has the time by which the autopilot stamped its attitude, put on this computer's clock as a whole: the way to the
agent delays each frame by another few milliseconds, which would move every row.

Payloads are read with fixed layouts instead of the dialect's decoder, which costs thirty times as much.
"""

import math
from collections.abc import Iterable
from itertools import islice
from struct import Struct
from typing import Final

from wire.autopilots import registry
from wire.dialect import mavlink
from wire.frames import message_id, payload, source
from wire.places import place_of

MIN_STEP_MS: Final = 4
"""Between two rows: no more than twice what can be requested, whoever requests it."""
MEASURED: Final = 300
"""Attitudes that say how the two clocks differ: the one with the shortest way counts."""
MAX_APART_US: Final = 2_000_000
"""A clock that is so far off has begun again: the autopilot has rebooted."""
HEADER: Final = (
    "time_s,roll_deg,pitch_deg,yaw_deg,roll_rate_deg_s,pitch_rate_deg_s,yaw_rate_deg_s,"
    "lat_deg,lon_deg,alt_msl_m,alt_rel_m,north_m_s,east_m_s,down_m_s,"
    "rc1,rc2,rc3,rc4,rc5,rc6,rc7,rc8,stick_x,stick_y,stick_z,stick_r,"
    "out1,out2,out3,out4,out5,out6,out7,out8,battery_v,battery_a,battery_percent,mode,armed\n"
)
"""`rc`: microseconds, of RC_CHANNELS, or as the ground sent them. `stick`: of MANUAL_CONTROL. Empty: not known."""

_ATTITUDE: Final = Struct("<Iffffff")
_POSITION: Final = Struct("<IiiiihhhH")
_STATUS: Final = Struct("<IIIHHhHHHHHHb")
_HEARTBEAT: Final = Struct("<IBBBBB")
_OUTPUTS: Final = Struct("<I8H")
_CHANNELS: Final = Struct("<I8H")
_OVERRIDE: Final = Struct("<8H")
_MANUAL: Final = Struct("<hhhh")
_ARMED: Final = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_DEG: Final = 180.0 / math.pi
_AUTOPILOT: Final = mavlink.MAV_COMP_ID_AUTOPILOT1

_ID_ATTITUDE: Final = mavlink.MAVLINK_MSG_ID_ATTITUDE
_LAYOUTS: Final = {
    _ID_ATTITUDE: _ATTITUDE,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _POSITION,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: _STATUS,
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: _HEARTBEAT,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: _OUTPUTS,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS: _CHANNELS,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE: _OVERRIDE,
    mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL: _MANUAL,
}
_FROM_GROUND: Final = (mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE, mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL)


def clock_offset_us(entries: Iterable[tuple[int, bytes]]) -> int | None:
    """Returns how much this computer's clock is ahead of the autopilot's, by the first attitudes of a flight. None
    without any."""
    offsets = (at_us - 1000 * _boot_ms(frame) for at_us, frame in entries if _is_attitude(frame))
    return min(islice(offsets, MEASURED), default=None)


def _is_attitude(frame: bytes) -> bool:
    return bool(message_id(frame) == _ID_ATTITUDE and source(frame)[1] == _AUTOPILOT)


def _boot_ms(frame: bytes) -> int:
    return int.from_bytes(payload(frame)[:4].ljust(4, b"\0"), "little")


class CsvRows:
    """Feed it the entries of one flight in order. `offset_us`: as `clock_offset_us` found it."""

    def __init__(self, offset_us: int | None = None) -> None:
        self._offset_us = offset_us
        self._row_ms = -MIN_STEP_MS
        self._position = ",,,,,,"
        self._rc = ",,,,,,,"
        self._has_channels = False
        self._sticks = ",,,"
        self._outputs = ",,,,,,,"
        self._battery = ",,"
        self._mode = ","

    def take(self, at_us: int, frame: bytes) -> str:
        """Returns the row that this frame makes; empty for most."""
        kind = message_id(frame)
        layout = _LAYOUTS.get(kind)
        if layout is None or (source(frame)[1] != _AUTOPILOT and kind not in _FROM_GROUND):
            return ""
        values = layout.unpack_from(payload(frame).ljust(layout.size, b"\0"))
        if kind == _ID_ATTITUDE:
            row_us = self._stamped(int(values[0]), at_us)
            if row_us is None:
                return ""
            angles = ",".join(f"{one * _DEG:.3f}" for one in values[1:7])
            return (
                f"{row_us / 1e6:.4f},{angles},{self._position},{self._rc},{self._sticks},"
                f"{self._outputs},{self._battery},{self._mode}\n"
            )
        self._keep(kind, values)
        return ""

    def _stamped(self, boot_ms: int, at_us: int) -> int | None:
        """Returns the time of a row; None: it comes too soon after the one before."""
        if self._offset_us is None or abs(at_us - 1000 * boot_ms - self._offset_us) > MAX_APART_US:
            self._offset_us, self._row_ms = at_us - 1000 * boot_ms, boot_ms - MIN_STEP_MS
        if 0 <= boot_ms - self._row_ms < MIN_STEP_MS:
            return None
        self._row_ms = boot_ms
        return 1000 * boot_ms + self._offset_us

    def _keep(self, kind: int, values: tuple[float, ...]) -> None:
        if kind == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT:
            _, lat, lon, alt, rel, north, east, down, _ = values
            at = place_of(int(lat), int(lon))
            place = "," if at is None else f"{at[0]:.7f},{at[1]:.7f}"
            heights = f"{alt / 1000:.3f},{rel / 1000:.3f}"
            self._position = f"{place},{heights},{north / 100:.2f},{east / 100:.2f},{down / 100:.2f}"
        elif kind == mavlink.MAVLINK_MSG_ID_SYS_STATUS:
            volts = "" if values[4] == 0xFFFF else f"{values[4] / 1000:.3f}"
            amperes = "" if values[5] < 0 else f"{values[5] / 100:.2f}"
            self._battery = f"{volts},{amperes},{'' if values[12] < 0 else int(values[12])}"
        elif kind == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            profile = registry.nearest(int(values[2]), int(values[1]))
            self._mode = f"{profile.mode_name(int(values[0]))},{int(bool(int(values[3]) & _ARMED))}"
        elif kind == mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW:
            self._outputs = _texts(values[1:9])
        elif kind == mavlink.MAVLINK_MSG_ID_RC_CHANNELS:
            self._has_channels = True
            self._rc = _texts(values[1:9])
        elif kind == mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE:
            if not self._has_channels:
                self._rc = _texts(values)
        else:
            self._sticks = _texts(values)


def _texts(values: Iterable[float]) -> str:
    return ",".join(str(int(one)) for one in values)
