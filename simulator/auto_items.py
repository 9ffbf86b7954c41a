"""Mission item names, and the DO and CONDITION commands: speed, heading, camera, waiting."""

from __future__ import annotations

import math

from simulator.flight_state import FlightState
from simulator.geodesy import wrap_pi
from simulator.mission_plan import Item

WAYPOINT, LOITER_FOREVER, LOITER_TURNS, LOITER_TIME, RETURN, LAND, TAKE_OFF = 16, 17, 18, 19, 20, 21, 22
SPLINE, DELAY = 82, 93
CONDITION_DELAY, CONDITION_DISTANCE, CONDITION_YAW, JUMP, CHANGE_SPEED = 112, 114, 115, 177, 178
ROI_LOCATION, ROI_NONE, ROI = 195, 197, 201
DIGICAM_CONTROL, TRIGGER_DISTANCE, FENCE_ENABLE = 203, 206, 207
START_CAPTURE, STOP_CAPTURE = 2000, 2001

NAVIGATION = frozenset({WAYPOINT, LOITER_FOREVER, LOITER_TURNS, LOITER_TIME, RETURN, LAND, TAKE_OFF, SPLINE, DELAY})
NAMES = {
    WAYPOINT: "WP",
    LOITER_FOREVER: "LoitUnlim",
    LOITER_TURNS: "LoitTurns",
    LOITER_TIME: "LoitTime",
    RETURN: "RTL",
    LAND: "Land",
    TAKE_OFF: "Takeoff",
    SPLINE: "SplineWP",
    DELAY: "Delay",
}
YAW_REACHED_RAD = math.radians(3.0)


def begin_do_command(flight: FlightState, item: Item) -> None:
    """Executes a DO or CONDITION command. Unknown commands have no effect."""
    command = item.command
    if command == CHANGE_SPEED and item.number(0) in (0.0, 1.0) and item.number(1) > 0:
        flight.speed_override_mps = item.number(1)
    elif command == CONDITION_YAW:
        base = flight.body.attitude()[2] if item.number(3) else 0.0
        sign = -1.0 if item.number(3) and item.number(2) < 0 else 1.0
        flight.roi = None
        flight.yaw_override_rad = base + sign * math.radians(item.number(0))
    elif command in (ROI_LOCATION, ROI, ROI_NONE):
        wanted = command != ROI_NONE and item.has_place
        flight.roi = flight.origin.to_local(item.x * 1e-7, item.y * 1e-7) if wanted else None
    elif command == FENCE_ENABLE and item.number(0) in (0.0, 1.0):
        flight.parameters.set("FENCE_ENABLE", item.number(0))
    elif command == DIGICAM_CONTROL:
        if item.x:
            flight.camera.shoot(flight)
    elif command == TRIGGER_DISTANCE:
        flight.camera.every_metres(flight, item.number(0), at_once=item.number(2) == 1.0)
    elif command == START_CAPTURE:
        flight.camera.every_seconds(flight, item.number(1), int(item.number(2)))
    elif command == STOP_CAPTURE:
        flight.camera.stop()


def do_command_is_done(flight: FlightState, item: Item, *, since_s: float, to_go_m: float) -> bool:
    """Returns whether the next command may start. `to_go_m`: distance left to the target waypoint."""
    if item.command == CONDITION_DELAY:
        return flight.now_s - since_s >= item.number(0)
    if item.command == CONDITION_DISTANCE:
        return to_go_m <= item.number(0)
    if item.command == CONDITION_YAW and flight.yaw_override_rad is not None:
        return abs(wrap_pi(flight.yaw_override_rad - flight.body.attitude()[2])) < YAW_REACHED_RAD
    return True
