"""Whether a controller may take off, and by which commands. Pure."""

from typing import Final

from onboard_agent.autonomy.core.safe_commands import Limits
from wire.autopilots.commands import CommandRefused, CommandStep, VehicleState
from wire.autopilots.commands import TakeOff as PilotTakeOff
from wire.autopilots.profile import AutopilotProfile
from wire.controllers import ControllerWork

CLIMBS_WITHIN_S: Final = 60.0
AT_HEIGHT_M: Final = 0.7
"""Below the wanted height: the climb is over."""


def take_off_steps(
    height_m: float, work: ControllerWork, limits: Limits, profile: AutopilotProfile, state: VehicleState
) -> list[CommandStep] | str:
    """Returns the commands, or why not."""
    if not work.may_take_off:
        return "it was not permitted to take off"
    if not limits.min_height_m <= height_m <= limits.max_height_m:
        return f"{height_m:g} m is not within the limits"
    try:
        return list(profile.steps(state, PilotTakeOff(height_m)))
    except CommandRefused as error:
        return str(error)
