"""PX4's geofence: uploaded fences, GF_MAX_* if set, and GF_ACTION for the response to a breach."""

from __future__ import annotations

from enum import IntEnum

from simulator.fence import NO_LIMITS, FenceLimits
from simulator.flight_state import FlightState
from simulator.mission_plan import PlanKind
from simulator.notices import Severity
from simulator.px4.modes import Px4Mode

NOTHING, WARN, TERMINATE = 0, 1, 4
_MODES = {2: Px4Mode.LOITER, 3: Px4Mode.RTL, 5: Px4Mode.LAND}


def fence_limits(flight: FlightState) -> FenceLimits:
    parameters = flight.parameters
    if parameters.whole("GF_ACTION") == NOTHING:
        return NO_LIMITS
    return FenceLimits(
        alt_max_m=parameters["GF_MAX_VER_DIST"] or None,
        radius_m=parameters["GF_MAX_HOR_DIST"] or None,
        drawn=bool(flight.plans.items[PlanKind.FENCE]),
    )


def on_fence_breach(flight: FlightState) -> IntEnum | None:
    """No mode is kept: flight by hand or by command may continue afterwards."""
    action = flight.parameters.whole("GF_ACTION")
    if action == TERMINATE:
        flight.disarm()
        flight.notify(Severity.EMERGENCY, "Geofence violation! Executing flight termination")
    elif action != WARN and flight.mode is not Px4Mode.LAND:
        flight.set_mode(_MODES.get(action, Px4Mode.LOITER))
    return None
