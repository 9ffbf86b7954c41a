"""The flight modes of autopilots by name, for people, and those in which a mission is flown. Pure.

An autopilot or a vehicle without a profile is read as its nearest kin.
"""

from wire.autopilots import registry


def mode_name(autopilot_kind: int, vehicle_type: int, custom_mode: int) -> str:
    """The ground stations' name for it; "mode 99" for an unknown one."""
    return registry.nearest(autopilot_kind, vehicle_type).mode_name(custom_mode)


def mission_modes(autopilot_kind: int, vehicle_type: int) -> frozenset[int]:
    """The custom_mode of each mode in which the autopilot follows its mission."""
    return registry.nearest(autopilot_kind, vehicle_type).mission_numbers
