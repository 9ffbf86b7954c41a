"""The places of the mission on board, for a controller. Pure."""

from typing import Final

from onboard_agent.autonomy.core.lines import MAX_WAYPOINTS, Waypoint
from wire.dialect import mavlink
from wire.plans import Plan

_PLACES: Final = frozenset(
    {
        int(mavlink.MAV_CMD_NAV_WAYPOINT),
        int(mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT),
        int(mavlink.MAV_CMD_NAV_LOITER_UNLIM),
        int(mavlink.MAV_CMD_NAV_LOITER_TURNS),
        int(mavlink.MAV_CMD_NAV_LOITER_TIME),
    }
)
_ABOVE_HOME: Final = (int(mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT), int(mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT))
_GLOBAL: Final = frozenset({0, 5, 10, 11, *_ABOVE_HOME})


def waypoints(mission: Plan) -> tuple[Waypoint, ...]:
    """Returns the first MAX_WAYPOINTS places that the mission flies to; take-off, landing and actions are none."""
    places = [one for one in mission if one.command in _PLACES and one.frame in _GLOBAL and (one.x, one.y) != (0, 0)]
    return tuple(
        Waypoint(one.x / 1e7, one.y / 1e7, one.z if one.frame in _ABOVE_HOME else None)
        for one in places[:MAX_WAYPOINTS]
    )
