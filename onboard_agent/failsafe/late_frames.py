"""Which frames may not arrive late, and how late is too late. Pure.

Old sticks do not show where the pilot's hand is now, and an old command was meant for a drone in another place.
Messages that only request or announce may be late.
"""

from typing import Final

from wire.control_messages import SafetySettings
from wire.dialect import mavlink

STICKS: Final = frozenset({mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL, mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE})

COMMANDS: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_SET_MODE,
        mavlink.MAVLINK_MSG_ID_COMMAND_INT,
        mavlink.MAVLINK_MSG_ID_COMMAND_LONG,
        mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET,
        mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
        mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
        mavlink.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET,
        mavlink.MAVLINK_MSG_ID_SET_HOME_POSITION,
        mavlink.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN,
        mavlink.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST,
        mavlink.MAVLINK_MSG_ID_MISSION_COUNT,
        mavlink.MAVLINK_MSG_ID_MISSION_ITEM,
        mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT,
        mavlink.MAVLINK_MSG_ID_MISSION_SET_CURRENT,
        mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL,
        mavlink.MAVLINK_MSG_ID_FENCE_POINT,
        mavlink.MAVLINK_MSG_ID_RALLY_POINT,
        mavlink.MAVLINK_MSG_ID_PARAM_SET,
        mavlink.MAVLINK_MSG_ID_PARAM_EXT_SET,
    }
)
"""Messages that change what the drone does, now or later."""


def too_late(message_id: int, late_s: float, settings: SafetySettings) -> str | None:
    """Returns why a frame that is this late is discarded, or None."""
    if message_id in STICKS:
        return "sticks too late" if late_s > settings.sticks_late_s else None
    if message_id in COMMANDS:
        return "command too late" if late_s > settings.commands_late_s else None
    return None
