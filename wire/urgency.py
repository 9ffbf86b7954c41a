"""Which messages leave at once, and which may wait briefly to share a datagram. One table, both directions.

Urgent messages are those that somebody or something waits for: sticks, a command and its acknowledgement, heartbeats,
and transfers in which each message requests the next one (every step would pay for the wait).
"""

from typing import Final

from wire.dialect import mavlink
from wire.frames import MAGIC_V2, message_id

_STICKS: Final = "MANUAL_CONTROL RC_CHANNELS_OVERRIDE"
_COMMANDS: Final = (
    "COMMAND_LONG COMMAND_INT SET_MODE SET_ATTITUDE_TARGET SET_POSITION_TARGET_LOCAL_NED "
    "SET_POSITION_TARGET_GLOBAL_INT SET_ACTUATOR_CONTROL_TARGET SET_HOME_POSITION MISSION_SET_CURRENT "
    "MISSION_CLEAR_ALL"
)
_ANSWERS: Final = "COMMAND_ACK MISSION_ACK"
_SIGNS_OF_LIFE: Final = "HEARTBEAT TIMESYNC"
_STEP_BY_STEP: Final = (
    "MISSION_COUNT MISSION_REQUEST MISSION_REQUEST_INT MISSION_REQUEST_LIST MISSION_ITEM MISSION_ITEM_INT "
    "PARAM_SET PARAM_REQUEST_READ FILE_TRANSFER_PROTOCOL"
)

URGENT: Final = frozenset(
    getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    for names in (_STICKS, _COMMANDS, _ANSWERS, _SIGNS_OF_LIFE, _STEP_BY_STEP)
    for name in names.split()
)
"""Message ids. None is above 255, which `is_urgent` relies on."""


def is_urgent(frame: bytes) -> bool:
    """Returns whether a whole frame must not wait."""
    if frame[0] == MAGIC_V2:
        return frame[7] in URGENT and not (frame[8] or frame[9])
    return message_id(frame) in URGENT
