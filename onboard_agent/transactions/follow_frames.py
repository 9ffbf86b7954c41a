"""Messages to a follower's autopilot: a target with a velocity, or a stop. Pure."""

from typing import Any, Final

from onboard_agent.transactions.follow_course import Motion
from wire.dialect import mavlink

_AUTOPILOT: Final = 1
_NAN: Final = float("nan")
_ABOVE_SEA: Final = int(mavlink.MAV_FRAME_GLOBAL_INT)
_PLACE_AND_SPEED: Final = 0b1101_1100_0000
"""Type mask: no acceleration, no yaw, no yaw rate."""
_SPEED_ONLY: Final = _PLACE_AND_SPEED | 0b111
_AS_IT_IS: Final = -1.0
_CHANGE_MODE: Final = 1.0


def target(system_id: int, at: Motion) -> Any:
    """ArduPilot: a position and its velocity. Sends no acknowledgement."""
    speed = (at.north_m_s, at.east_m_s, at.down_m_s)
    return _set_target(system_id, _PLACE_AND_SPEED, (round(at.lat_e7), round(at.lon_e7), at.alt_m), speed)


def standing(system_id: int) -> Any:
    """ArduPilot: zero velocity. Stops the drone until a hold mode is accepted, or if none is."""
    return _set_target(system_id, _SPEED_ONLY, (0, 0, 0.0), (0.0, 0.0, 0.0))


def _set_target(system_id: int, mask: int, at: tuple[int, int, float], speed: tuple[float, float, float]) -> Any:
    rest = (0.0, 0.0, 0.0, 0.0, 0.0)
    return mavlink.MAVLink_set_position_target_global_int_message(
        0, system_id, _AUTOPILOT, _ABOVE_SEA, mask, *at, *speed, *rest
    )


def go_there(system_id: int, at: Motion) -> Any:
    """PX4: a command, which PX4 acknowledges."""
    params = (_AS_IT_IS, _CHANGE_MODE, 0.0, _NAN)
    return mavlink.MAVLink_command_int_message(
        system_id,
        _AUTOPILOT,
        int(mavlink.MAV_FRAME_GLOBAL),
        mavlink.MAV_CMD_DO_REPOSITION,
        0,
        0,
        *params,
        round(at.lat_e7),
        round(at.lon_e7),
        at.alt_m,
    )
