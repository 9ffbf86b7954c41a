"""Finds the profile of a vehicle. The table consists of the files of this package that have a `PROFILE`. Pure."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import Final

from wire import autopilots
from wire.autopilots.profile import AutopilotFamily, AutopilotProfile
from wire.dialect import mavlink


def _profiles() -> tuple[AutopilotProfile, ...]:
    names = sorted(info.name for info in iter_modules(autopilots.__path__) if info.name != "registry")
    modules = (import_module(f"{autopilots.__name__}.{name}") for name in names)
    return tuple(module.PROFILE for module in modules if hasattr(module, "PROFILE"))


PROFILES: Final = _profiles()
"""Every profile, in the order of the file names."""
FAMILIES: Final = {profile.family.autopilot: profile.family for profile in PROFILES}
"""By MAV_AUTOPILOT."""
_BY_VEHICLE: Final = {
    (profile.family.autopilot, vehicle): profile for profile in PROFILES for vehicle in profile.vehicle_types
}
_STAND_INS: Final = {profile.family.autopilot: profile for profile in PROFILES if profile.stands_in}
USUAL: Final = FAMILIES[int(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)]
"""An unknown autopilot is read as one of these."""


def of(autopilot: int, vehicle_type: int) -> AutopilotProfile | None:
    """Looks up by MAV_AUTOPILOT and MAV_TYPE; None for an unknown vehicle."""
    return _BY_VEHICLE.get((autopilot, vehicle_type))


def nearest(autopilot: int, vehicle_type: int) -> AutopilotProfile:
    """Returns the same, or the nearest related profile. Only for reading modes in doubt, never for commands: an unknown
    autopilot is read as one of `USUAL`."""
    known = autopilot if autopilot in FAMILIES else USUAL.autopilot
    return of(known, vehicle_type) or _STAND_INS[known]


def multicopter(autopilot: int) -> AutopilotProfile:
    """Returns the multicopter profile if only the autopilot is known."""
    return nearest(autopilot, int(mavlink.MAV_TYPE_QUADROTOR))


def family_named(name: str) -> AutopilotFamily | None:
    """Looks up by the name that agent and tower exchange."""
    return next((family for family in FAMILIES.values() if family.name == name), None)
