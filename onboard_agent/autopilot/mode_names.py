"""Names of the autopilots' flight modes for people, and the modes that fly a mission. Pure.

An autopilot or vehicle without a profile uses the nearest profile.
"""

from wire.autopilots import registry


def mode_name(autopilot_kind: int, vehicle_type: int, custom_mode: int) -> str:
    """Returns the name that ground stations use; "mode 99" for a mode without a name."""
    return registry.nearest(autopilot_kind, vehicle_type).mode_name(custom_mode)


def mission_modes(autopilot_kind: int, vehicle_type: int) -> frozenset[int]:
    """Returns the custom_mode of each mode in which the autopilot flies, drives or dives its mission."""
    return registry.nearest(autopilot_kind, vehicle_type).mission_numbers
