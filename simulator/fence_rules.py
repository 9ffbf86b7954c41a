"""ArduCopter's fence parameters: which limits apply, and what a breach causes."""

from __future__ import annotations

from enum import IntEnum

from simulator.command_message import Command
from simulator.fence import NO_LIMITS, FenceLimits
from simulator.flight_state import FlightState
from simulator.modes import Mode

ALT_MAX, CIRCLE, DRAWN, ALT_MIN = 1, 2, 4, 8
"""FENCE_TYPE."""
KEEPS_MODE, ANY_INCLUSION = 1, 2
"""FENCE_OPTIONS."""
ACTIONS = {1: Mode.RTL, 2: Mode.LAND, 3: Mode.RTL, 4: Mode.BRAKE, 5: Mode.LAND}
"""FENCE_ACTION. Without SMART_RTL, 3 equals 1 and 5 equals 2, the modes that they fall back to."""
ACCEPTED, FAILED = 0, 4


def fence_limits(flight: FlightState) -> FenceLimits:
    parameters = flight.parameters
    if not parameters.whole("FENCE_ENABLE"):
        return NO_LIMITS
    kinds, options = parameters.whole("FENCE_TYPE"), parameters.whole("FENCE_OPTIONS")
    return FenceLimits(
        alt_max_m=parameters["FENCE_ALT_MAX"] if kinds & ALT_MAX else None,
        alt_min_m=parameters["FENCE_ALT_MIN"] if kinds & ALT_MIN else None,
        radius_m=parameters["FENCE_RADIUS"] if kinds & CIRCLE else None,
        drawn=bool(kinds & DRAWN),
        any_inclusion=bool(options & ANY_INCLUSION),
    )


def on_fence_breach(flight: FlightState) -> IntEnum | None:
    """Returns the mode that must be kept until the breach is over, or None."""
    wanted = ACTIONS.get(flight.parameters.whole("FENCE_ACTION"))
    if wanted is None or flight.mode is Mode.LAND:
        return None
    if not flight.set_mode(wanted):
        wanted = Mode.LAND
        flight.set_mode(wanted)
    return wanted if flight.parameters.whole("FENCE_OPTIONS") & KEEPS_MODE else None


def enable_fence(flight: FlightState, command: Command) -> int:
    """MAV_CMD_DO_FENCE_ENABLE: 0 off, 1 on, 2 the floor only."""
    goal = int(command.params[0])
    if goal not in (0, 1, 2):
        return FAILED
    if goal == 2:
        flight.parameters.set("FENCE_TYPE", flight.parameters.whole("FENCE_TYPE") & ~ALT_MIN)
    else:
        flight.parameters.set("FENCE_ENABLE", goal)
    return ACCEPTED
