"""Reads a drone's frames into `Telemetry`. Pure: frames and `now` in.

Only the autopilot's component counts: cameras and gimbals send heartbeats too. NAMED_VALUE_FLOAT counts from any of
them, because sensors on board send it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import degrees
from types import MappingProxyType
from typing import Any, Final

from control_tower.values import Telemetry
from wire.autopilots import registry
from wire.dialect import decode, mavlink

MAX_VALUES: Final = 128
"""Named values kept of one drone; a new name beyond that is dropped."""
_AUTOPILOT: Final = mavlink.MAV_COMP_ID_AUTOPILOT1
_UNKNOWN_U16: Final = 0xFFFF


class TelemetryReader:
    """One drone. `newest` is replaced, never changed."""

    def __init__(self) -> None:
        self.newest = Telemetry()
        self.system_id = 1
        """Of the autopilot; 1 until it is heard."""
        self.texts: list[tuple[int, str]] = []
        """STATUSTEXT since the caller last emptied it: severity and text."""

    def take(self, frame: bytes, now: float) -> bool:
        """Takes one whole frame. Returns whether `newest` was replaced."""
        message = decode(frame)
        if message is None:
            return False
        kind = message.get_type()
        if kind == "NAMED_VALUE_FLOAT":
            return self._value(message.name, message.value, now)
        if message.get_srcComponent() != _AUTOPILOT:
            return False
        if kind == "HEARTBEAT":
            self.system_id = message.get_srcSystem()
        if kind == "STATUSTEXT":
            self.texts.append((message.severity, message.text))
            return False
        fields_of = _FIELDS.get(kind)
        if fields_of is None:
            return False
        self.newest = replace(self.newest, heard_at_s=now, **fields_of(message))
        return True

    def _value(self, name: str, value: float, now: float) -> bool:
        values = dict(self.newest.values)
        if name not in values and len(values) >= MAX_VALUES:
            return False
        values[name] = value
        self.newest = replace(self.newest, heard_at_s=now, values=MappingProxyType(values))
        return True


def _heartbeat(m: Any) -> dict[str, Any]:
    armed = bool(m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
    return {"armed": armed, "mode": registry.nearest(m.autopilot, m.type).mode_name(m.custom_mode)}


def _position(m: Any) -> dict[str, Any]:
    fields = {
        "altitude_m": m.alt / 1e3,
        "height_m": m.relative_alt / 1e3,
        "north_m_s": m.vx / 1e2,
        "east_m_s": m.vy / 1e2,
        "down_m_s": m.vz / 1e2,
        "heading_deg": None if m.hdg == _UNKNOWN_U16 else m.hdg / 1e2,
    }
    if m.lat or m.lon:  # both are 0 while there is no position
        fields |= {"lat_deg": m.lat / 1e7, "lon_deg": m.lon / 1e7}
    return fields


def _attitude(m: Any) -> dict[str, Any]:
    return {"roll_deg": degrees(m.roll), "pitch_deg": degrees(m.pitch), "yaw_deg": degrees(m.yaw) % 360.0}


def _air(m: Any) -> dict[str, Any]:
    return {"airspeed_m_s": m.airspeed, "ground_speed_m_s": m.groundspeed, "throttle_percent": float(m.throttle)}


def _battery(m: Any) -> dict[str, Any]:
    return {
        "battery_percent": None if m.battery_remaining < 0 else float(m.battery_remaining),
        "battery_v": None if m.voltage_battery == _UNKNOWN_U16 else m.voltage_battery / 1e3,
        "battery_a": None if m.current_battery < 0 else m.current_battery / 1e2,
    }


def _gps(m: Any) -> dict[str, Any]:
    return {"gps_fix": m.fix_type, "satellites": None if m.satellites_visible == 255 else m.satellites_visible}


def _home(m: Any) -> dict[str, Any]:
    return {
        "home_lat_deg": m.latitude / 1e7,
        "home_lon_deg": m.longitude / 1e7,
        "home_altitude_m": m.altitude / 1e3,
    }


_FIELDS: Final[Mapping[str, Callable[[Any], dict[str, Any]]]] = {
    "HEARTBEAT": _heartbeat,
    "GLOBAL_POSITION_INT": _position,
    "ATTITUDE": _attitude,
    "VFR_HUD": _air,
    "SYS_STATUS": _battery,
    "GPS_RAW_INT": _gps,
    "HOME_POSITION": _home,
    "MISSION_CURRENT": lambda m: {"mission_item": m.seq},
}
