"""The phases of a controller's flight, and what ends it from outside in each. Pure."""

from enum import StrEnum
from typing import Final

from onboard_agent.autopilot.mode_names import mode_name
from onboard_agent.transactions.handler import Around
from wire.autopilots import registry
from wire.autopilots.profile import AutopilotProfile


class Phase(StrEnum):
    """What the flight does; also for people."""

    STARTING = "starting"
    ON_GROUND = "on the ground"
    ENTERING = "taking control"
    FLYING = "flying"
    TAKING_OFF = "taking off"
    LANDING = "landing"


STREAMS: Final = (Phase.ENTERING, Phase.FLYING)
"""Phases in which set-points go out."""


def profile_of(around: Around) -> AutopilotProfile | None:
    """Returns the profile of a vehicle that obeys set-points, else None."""
    profile = registry.of(around.autopilot_kind, around.vehicle_type)
    return None if profile is None or profile.roles.setpoints is None else profile


def obeys_setpoints(around: Around) -> bool:
    """Whether the autopilot is in the mode that obeys set-points."""
    profile = profile_of(around)
    mode = None if profile is None else profile.roles.setpoints
    return mode is not None and around.custom_mode == mode.custom_mode


def why_ended(phase: Phase, around: Around) -> str | None:
    """Returns why the drone is out of reach or under other control; None: it is not."""
    if not around.heard:
        return "no heartbeat from the autopilot"
    if around.holding:
        return "a hold or another command came"
    if phase in STREAMS and not (around.armed and around.airborne):
        return "it is not in the air"
    if phase is Phase.FLYING and not obeys_setpoints(around):
        shown = mode_name(around.autopilot_kind, around.vehicle_type, around.custom_mode)
        return f"the autopilot changed to {shown}"
    if phase in (Phase.TAKING_OFF, Phase.ENTERING) and _goes_home(around):
        return "the autopilot goes home"
    return None


def _goes_home(around: Around) -> bool:
    profile = profile_of(around)
    modes = None if profile is None else profile.failsafe
    return modes is not None and any(around.custom_mode == one.custom_mode for one in modes.going_home)
