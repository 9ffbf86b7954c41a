"""Finds the profile of a vehicle. The table is made of the files of this package that have a `PROFILE`. Pure."""

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
"""Every profile, in the order of their files' names."""
FAMILIES: Final = {profile.family.autopilot: profile.family for profile in PROFILES}
"""By MAV_AUTOPILOT."""
_BY_VEHICLE: Final = {
    (profile.family.autopilot, vehicle): profile for profile in PROFILES for vehicle in profile.vehicle_types
}
_STAND_INS: Final = {profile.family.autopilot: profile for profile in PROFILES if profile.stands_in}
_USUAL: Final = int(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)


def of(autopilot: int, vehicle_type: int) -> AutopilotProfile | None:
    """By MAV_AUTOPILOT and MAV_TYPE; None for an unknown vehicle."""
    return _BY_VEHICLE.get((autopilot, vehicle_type))


def nearest(autopilot: int, vehicle_type: int) -> AutopilotProfile:
    """The same, or the most similar profile. For reading modes only, never for commands: an unknown autopilot is read
    as ArduPilot."""
    known = autopilot if autopilot in FAMILIES else _USUAL
    return of(known, vehicle_type) or _STAND_INS[known]


def multicopter(autopilot: int) -> AutopilotProfile:
    """The same, where only the autopilot is known: of one with rotors alone."""
    return nearest(autopilot, int(mavlink.MAV_TYPE_QUADROTOR))


def family_named(name: str) -> AutopilotFamily | None:
    """By the name that agent and tower tell each other."""
    return next((family for family in FAMILIES.values() if family.name == name), None)
