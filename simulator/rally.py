"""Where a return ends: at home or at the nearest rally point."""

from __future__ import annotations

import math
from dataclasses import dataclass

from simulator.flight_state import FlightState
from simulator.mission_plan import Frame, PlanKind


@dataclass(frozen=True, slots=True)
class ReturnPoint:
    """Metres from the origin. `alt_over_home_m` None: the point sets no return height, as with home."""

    north_m: float
    east_m: float
    alt_over_home_m: float | None = None


def nearest_return_point(flight: FlightState) -> ReturnPoint:
    """Rally points farther than RALLY_LIMIT_KM do not count (0: all do); home counts only if RALLY_INCL_HOME is set or
    there is no other point."""
    here = (flight.body.north_m, flight.body.east_m)
    home_n, home_e, home_alt = flight.home_local()
    home = ReturnPoint(home_n, home_e)
    limit_m = flight.parameters["RALLY_LIMIT_KM"] * 1000.0
    points = []
    for item in flight.plans.items[PlanKind.RALLY]:
        north_m, east_m = flight.origin.to_local(item.x * 1e-7, item.y * 1e-7)
        above = flight.origin.origin.alt_amsl_m + home_alt if item.frame in (Frame.GLOBAL, Frame.GLOBAL_INT) else 0.0
        if limit_m <= 0.0 or math.dist(here, (north_m, east_m)) <= limit_m:
            points.append(ReturnPoint(north_m, east_m, item.z - above))
    if not points or flight.parameters.whole("RALLY_INCL_HOME"):
        points.append(home)
    return min(points, key=lambda place: math.dist(here, (place.north_m, place.east_m)))
