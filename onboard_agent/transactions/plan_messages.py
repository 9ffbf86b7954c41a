"""Messages of the mission protocol that the agent reads, and those that it blocks. Pure."""

from typing import Final

from wire.dialect import mavlink

HEARD: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_MISSION_COUNT,
        mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT,
        mavlink.MAVLINK_MSG_ID_MISSION_REQUEST,
        mavlink.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
        mavlink.MAVLINK_MSG_ID_MISSION_ACK,
    }
)
"""Messages of the autopilot that `receive` takes."""

KEPT_OUT: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_MISSION_COUNT,
        mavlink.MAVLINK_MSG_ID_MISSION_CLEAR_ALL,
        mavlink.MAVLINK_MSG_ID_MISSION_WRITE_PARTIAL_LIST,
        mavlink.MAVLINK_MSG_ID_MISSION_ITEM,
        mavlink.MAVLINK_MSG_ID_MISSION_ITEM_INT,
        mavlink.MAVLINK_MSG_ID_FENCE_POINT,
        mavlink.MAVLINK_MSG_ID_RALLY_POINT,
    }
)
"""Messages with which a ground station writes a plan."""
