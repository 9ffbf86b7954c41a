"""The flight modes of autopilots by name, for people, and those in which a mission is flown. Pure.

Numbers as in AUTOPILOTS: ArduPilot's are those of its vehicles, PX4's main and sub mode packed into one.
"""

from typing import Any, Final

from onboard_agent.autopilot.flight_modes import is_copter, px4_custom_mode
from wire.dialect import mavlink

_PX4_AUTO: Final = 4
_PX4: Final = {
    px4_custom_mode(1, 0): "MANUAL",
    px4_custom_mode(2, 0): "ALTCTL",
    px4_custom_mode(3, 0): "POSCTL",
    px4_custom_mode(_PX4_AUTO, 1): "AUTO.READY",
    px4_custom_mode(_PX4_AUTO, 2): "AUTO.TAKEOFF",
    px4_custom_mode(_PX4_AUTO, 3): "AUTO.LOITER",
    px4_custom_mode(_PX4_AUTO, 4): "AUTO.MISSION",
    px4_custom_mode(_PX4_AUTO, 5): "AUTO.RTL",
    px4_custom_mode(_PX4_AUTO, 6): "AUTO.LAND",
    px4_custom_mode(_PX4_AUTO, 8): "AUTO.FOLLOW",
    px4_custom_mode(_PX4_AUTO, 9): "AUTO.PRECLAND",
    px4_custom_mode(5, 0): "ACRO",
    px4_custom_mode(6, 0): "OFFBOARD",
    px4_custom_mode(7, 0): "STABILIZED",
}

_PX4_MISSIONS: Final = frozenset({px4_custom_mode(_PX4_AUTO, 4), px4_custom_mode(_PX4_AUTO, 0)})
"""A main mode AUTO without a sub mode is the mission."""

_ROVERS: Final = frozenset({mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_TYPE_SURFACE_BOAT})
_AUTO_OF_COPTERS: Final = frozenset({3, 27})
"""AUTO, and AUTO_RTL, which flies the end of the mission."""
_AUTO_OF_OTHERS: Final = frozenset({10})


def mode_name(autopilot_kind: int, vehicle_type: int, custom_mode: int) -> str:
    """As ground stations call it; "mode 99" where nobody has a name."""
    if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4:
        return _PX4.get(custom_mode, f"mode {custom_mode}")
    prefix = "COPTER_MODE"
    if vehicle_type == mavlink.MAV_TYPE_SUBMARINE:
        prefix = "SUB_MODE"
    elif vehicle_type in _ROVERS:
        prefix = "ROVER_MODE"
    elif not is_copter(vehicle_type):
        prefix = "PLANE_MODE"
    known: Any = mavlink.enums[prefix].get(custom_mode)
    return str(known.name).removeprefix(f"{prefix}_") if known is not None else f"mode {custom_mode}"


def mission_modes(autopilot_kind: int, vehicle_type: int) -> frozenset[int]:
    """The custom_mode of each mode in which the autopilot flies, drives or dives what stands in its mission."""
    if autopilot_kind == mavlink.MAV_AUTOPILOT_PX4:
        return _PX4_MISSIONS
    if is_copter(vehicle_type) or vehicle_type == mavlink.MAV_TYPE_SUBMARINE:
        return _AUTO_OF_COPTERS
    return _AUTO_OF_OTHERS
