"""Flies a square of 40 m, without asyncio.

TOWER_URL=https://tower.example.org TOWER_TOKEN=twt_... python go_to.py Kestrel
"""

import sys

from control_tower import ControlLost, distance_m, offset, sync

HEIGHT_M = 15
SQUARE_M = ((40, 0), (40, 40), (0, 40), (0, 0))
"""North and east of the place of the take-off."""


def main(name: str) -> list[float]:
    """Returns how far from each corner the drone arrived, in metres."""
    missed_m = []
    with sync.Tower() as tower, tower.drone(name).fly() as flight:
        flight.take_off(HEIGHT_M)
        start = flight.telemetry.place
        assert start is not None  # it has taken off
        for north_m, east_m in SQUARE_M:
            corner = offset(*start, north_m, east_m)
            flight.go_to(*corner, HEIGHT_M, speed_m_s=8)
            here = flight.telemetry.place
            assert here is not None
            missed_m.append(distance_m(*here, *corner))
            print(f"{missed_m[-1]:.1f} m from the corner")
        flight.return_home()
    return missed_m


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except ControlLost as lost:
        sys.exit(f"the flight is over: {lost}")
