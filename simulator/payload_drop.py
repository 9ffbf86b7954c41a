"""What falls when a gripper opens: the payload's way to the ground, without drag, and where it lands."""

from __future__ import annotations

import logging
import math
from typing import Final

from simulator.flight import Flight
from simulator.notices import Severity

log = logging.getLogger("simulator")

GRAVITY_M_S2: Final = 9.80665


def drop(flight: Flight) -> None:
    """What an opened gripper lets go in the air. A notice says where that lands."""
    if flight.landed:
        return
    lat_deg, lon_deg = landing_place(flight)
    words = f"Payload landed at {lat_deg:.7f},{lon_deg:.7f}"
    log.info("%s", words)
    flight.notify(Severity.INFO, words)


def landing_place(flight: Flight) -> tuple[float, float]:
    """Returns latitude and longitude where something lands that is let go now."""
    body = flight.body
    north_m, east_m, height_m, _ = body.true_pose
    height_m = max(height_m - body.ground_m(), 0.0)
    climb_m_s = -body.vd_mps
    falls_s = (climb_m_s + math.sqrt(climb_m_s**2 + 2.0 * GRAVITY_M_S2 * height_m)) / GRAVITY_M_S2
    place = flight.origin.to_place(north_m + body.vn_mps * falls_s, east_m + body.ve_mps * falls_s, 0.0)
    return place.lat_deg, place.lon_deg
