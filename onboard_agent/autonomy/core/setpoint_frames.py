"""A set-point as the MAVLink message that ArduCopter (GUIDED) and PX4 (OFFBOARD) both obey. Pure.

A velocity is SET_POSITION_TARGET_LOCAL_NED, a place SET_POSITION_TARGET_GLOBAL_INT above sea level. Both carry the yaw,
so that the nose stays where the controller's directions assume it.
"""

from math import radians
from typing import Any, Final

from onboard_agent.autonomy.core.course import Setpoint, Velocity
from onboard_agent.autonomy.core.local_plane import LocalPlane
from wire.dialect import mavlink

_AUTOPILOT: Final = 1
_NO_POSITION: Final = 0b0000_0000_0111
_NO_VELOCITY: Final = 0b0000_0011_1000
_NO_ACCELERATION: Final = 0b0001_1100_0000
_NO_YAW_RATE: Final = 0b1000_0000_0000
VELOCITY_MASK: Final = _NO_POSITION | _NO_ACCELERATION | _NO_YAW_RATE
PLACE_MASK: Final = _NO_VELOCITY | _NO_ACCELERATION | _NO_YAW_RATE
_LOCAL_NED: Final = int(mavlink.MAV_FRAME_LOCAL_NED)
_ABOVE_SEA: Final = int(mavlink.MAV_FRAME_GLOBAL_INT)


def setpoint_message(
    system_id: int, setpoint: Setpoint, plane: LocalPlane, *, home_alt_m: float, boot_ms: int = 0
) -> Any:
    """Returns the message. `home_alt_m`: above sea level."""
    yaw = radians((setpoint.heading_deg + 180.0) % 360.0 - 180.0)
    rest = (0.0, 0.0, 0.0, yaw, 0.0)
    if isinstance(setpoint, Velocity):
        speed = (setpoint.north_m_s, setpoint.east_m_s, -setpoint.up_m_s)
        return mavlink.MAVLink_set_position_target_local_ned_message(
            boot_ms, system_id, _AUTOPILOT, _LOCAL_NED, VELOCITY_MASK, 0.0, 0.0, 0.0, *speed, *rest
        )
    lat, lon = plane.on_map(setpoint.north_m, setpoint.east_m)
    at = (round(lat * 1e7), round(lon * 1e7), home_alt_m + setpoint.height_m)
    return mavlink.MAVLink_set_position_target_global_int_message(
        boot_ms, system_id, _AUTOPILOT, _ABOVE_SEA, PLACE_MASK, *at, 0.0, 0.0, 0.0, *rest
    )
