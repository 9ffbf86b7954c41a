"""The flight as a table: one row for each ATTITUDE of the autopilot, at most 100 a second, with the newest of
everything else. No I/O.

Payloads are read with fixed layouts instead of the dialect's decoder, which costs thirty times as much.
"""

import math
from collections.abc import Iterable
from struct import Struct
from typing import Final

from wire.autopilots import registry
from wire.dialect import mavlink
from wire.frames import message_id, payload, source
from wire.places import place_of

MIN_STEP_US: Final = 10_000
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


class CsvRows:
    """Feed it the entries of one flight in order."""

    def __init__(self) -> None:
        self._row_us = 0
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
        if kind == _ID_ATTITUDE and at_us - self._row_us < MIN_STEP_US:
            return ""
        values = layout.unpack_from(payload(frame).ljust(layout.size, b"\0"))
        if kind == _ID_ATTITUDE:
            self._row_us = at_us
            angles = ",".join(f"{one * _DEG:.3f}" for one in values[1:7])
            return (
                f"{at_us / 1e6:.4f},{angles},{self._position},{self._rc},{self._sticks},"
                f"{self._outputs},{self._battery},{self._mode}\n"
            )
        self._keep(kind, values)
        return ""

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
