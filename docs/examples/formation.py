"""Flies five drones in a wedge: up, along a leg, around a corner, and home. The token is an admin's, who may have the
controls of several drones.

    TOWER_URL=https://tower.example.org TOWER_TOKEN=twt_... python formation.py Kestrel Merlin Hobby Falcon Harrier
"""

import asyncio
import sys
from collections.abc import Iterable
from contextlib import AsyncExitStack

from control_tower import ControlLost, Flight, Tower, distance_m, offset, turned

WEDGE_M = ((0, 0), (-10, -10), (-10, 10), (-20, -20), (-20, 20))
"""North and east of the leader, when it flies north."""
LEGS_M = ((30, 0, 0), (30, 30, 90))
"""The leader's place, north and east of its start, and the course of the wedge there, in degrees."""
HEIGHT_M = 15


async def fly_to(
    flights: list[Flight], north_m: float, east_m: float, course_deg: float, start: tuple[float, float]
) -> None:
    """Brings every drone to its place in the wedge, and returns when all are there."""
    places = [turned(*place, course_deg) for place in WEDGE_M]
    corners = [offset(*start, north_m + north, east_m + east) for north, east in places]
    going = (flight.go_to(*corner, HEIGHT_M, speed_m_s=8) for flight, corner in zip(flights, corners, strict=True))
    await asyncio.gather(*going)


def nearest_m(flights: Iterable[Flight]) -> float:
    """Returns the smallest distance between two of them."""
    places = [place for flight in flights if (place := flight.telemetry.place) is not None]
    return min(distance_m(*one, *other) for number, one in enumerate(places) for other in places[:number])


async def main(names: list[str]) -> list[float]:
    """Returns the smallest distance between two drones after each leg, in metres."""
    nearest = []
    async with Tower() as tower, AsyncExitStack() as controls:
        # The loss of one ends the flight of all: the others return home.
        flights = [await controls.enter_async_context(tower.drone(name).fly()) for name in names]
        await asyncio.gather(*(flight.take_off(HEIGHT_M) for flight in flights))
        start = flights[0].telemetry.place
        assert start is not None  # it has taken off
        for leg in LEGS_M:
            await fly_to(flights, *leg, start)
            nearest.append(nearest_m(flights))
            print(f"the wedge is there; the nearest two are {nearest[-1]:.1f} m apart")
        await asyncio.gather(*(flight.return_home() for flight in flights))
    return nearest


if __name__ == "__main__":
    try:
        asyncio.run(main(sys.argv[1:]))
    except ControlLost as lost:
        sys.exit(f"the flight is over: {lost}")
