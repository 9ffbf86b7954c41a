"""Kinds of vehicles, as sets of MAV_TYPE. Pure."""

from typing import Final

from wire.dialect import mavlink

MULTICOPTERS: Final = frozenset(
    {
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_TYPE_COAXIAL,
        mavlink.MAV_TYPE_HELICOPTER,
        mavlink.MAV_TYPE_HEXAROTOR,
        mavlink.MAV_TYPE_OCTOROTOR,
        mavlink.MAV_TYPE_TRICOPTER,
        mavlink.MAV_TYPE_DODECAROTOR,
        mavlink.MAV_TYPE_DECAROTOR,
    }
)
"""Vehicles with rotors only."""

PLANES: Final = frozenset({mavlink.MAV_TYPE_FIXED_WING, *range(19, 26)})
"""MAV_TYPE 19 to 25 take off and land vertically."""

ROVERS: Final = frozenset({mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_TYPE_SURFACE_BOAT})
SUBMARINES: Final = frozenset({mavlink.MAV_TYPE_SUBMARINE})
NEVER_FLY: Final = ROVERS | SUBMARINES
"""In the air at no height above home."""
