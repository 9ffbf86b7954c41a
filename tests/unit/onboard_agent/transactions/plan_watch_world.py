"""A drone whose plans are watched, in the air and during uploads."""

from __future__ import annotations

from drone_world import ARM, AUTO, RTL, SET_MODE, DroneWorld, mavlink, waypoints

from wire.plans import PlanKind
from wire.transactions import (
    PlanUploadWork,
)

MISSION = PlanKind.MISSION

PLAN, OTHER = waypoints(12), waypoints(9, alt_m=40.0)


def uploading(world: DroneWorld, count: int = 200) -> int:
    """Starts an upload and stops when some of it is on board."""
    before = len(world.asked_of_autopilot("MISSION_ITEM_INT"))
    number = world.begin(PlanUploadWork(MISSION, waypoints(count)))
    world.until(lambda: len(world.asked_of_autopilot("MISSION_ITEM_INT")) > before, what="the upload begins")
    return number


STARTS = {
    "mode": mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, AUTO, 0, 0, 0, 0, 0),
    "auto-rtl": mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, 27, 0, 0, 0, 0, 0),
    "old-mode": mavlink.MAVLink_set_mode_message(1, 1, AUTO),
    "start": mavlink.MAVLink_command_long_message(1, 1, 300, 0, 0, 0, 0, 0, 0, 0, 0),
    "start-int": mavlink.MAVLink_command_int_message(1, 1, 3, 300, 0, 0, 0, 0, 0, 0, 0, 0, 0),
    "current": mavlink.MAVLink_command_long_message(1, 1, 224, 0, 3, 0, 0, 0, 0, 0, 0),
    "old-current": mavlink.MAVLink_mission_set_current_message(1, 1, 3),
    "continue": mavlink.MAVLink_command_long_message(1, 1, 193, 0, 1, 0, 0, 0, 0, 0, 0),
}

NO_STARTS = {
    "rtl": mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, RTL, 0, 0, 0, 0, 0),
    "arm": mavlink.MAVLink_command_long_message(1, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0),
    "pause": mavlink.MAVLink_command_long_message(1, 1, 193, 0, 0, 0, 0, 0, 0, 0, 0),
    "nan": mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, float("nan"), 0, 0, 0, 0, 0),
}
