"""Patrols around a square until the battery is down to a percentage, and comes home.

TOWER_URL=https://tower.example.org TOWER_TOKEN=twt_... python patrol.py Kestrel 40
"""

import asyncio
import itertools
import sys

from control_tower import ControlLost, Flight, Tower, offset

HEIGHT_M = 20
SQUARE_M = ((50, 0), (50, 50), (0, 50), (0, 0))


async def patrol(flight: Flight, start: tuple[float, float]) -> None:
    """Flies around for ever."""
    for north_m, east_m in itertools.cycle(SQUARE_M):
        await flight.go_to(*offset(*start, north_m, east_m), HEIGHT_M)


async def main(name: str, until_percent: float) -> float:
    """Returns what the battery has left at home, in percent."""

    def is_low(battery_percent: float | None) -> bool:
        return battery_percent is not None and battery_percent <= until_percent

    async with Tower() as tower, tower.drone(name).fly() as flight:
        await flight.take_off(HEIGHT_M)
        start = flight.telemetry.place
        assert start is not None  # it has taken off
        patrolling = asyncio.create_task(patrol(flight, start))
        low = asyncio.create_task(
            flight.until(lambda now: is_low(now.battery_percent), "low on battery", timeout_s=3600)
        )
        try:
            await asyncio.wait({patrolling, low}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            patrolling.cancel()
            low.cancel()
        if patrolling.done() and not patrolling.cancelled():
            patrolling.result()  # raises why it ended
        print(f"the battery has {flight.telemetry.battery_percent} %: home")
        await flight.return_home()
        return flight.telemetry.battery_percent or 0.0


if __name__ == "__main__":
    try:
        asyncio.run(main(sys.argv[1], float(sys.argv[2])))
    except ControlLost as lost:
        sys.exit(f"the flight is over: {lost}")
