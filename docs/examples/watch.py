"""Watches the squad for a while: what happens, and where each drone is. A token with the scope `watch` is enough.

TOWER_URL=https://tower.example.org TOWER_TOKEN=twt_... python watch.py 30
"""

import asyncio
import contextlib
import sys

from control_tower import Drone, Tower
from control_tower.events import ControlChanged, HoldStep, StatusText


async def positions(drone: Drone) -> None:
    with drone.watch() as telemetry:
        async for now in telemetry:
            if now.place is not None and now.height_m is not None:
                lat_deg, lon_deg = now.place
                print(f"{drone.name}: {lat_deg:.6f} {lon_deg:.6f} {now.height_m:.1f} m, {now.mode}")
            await asyncio.sleep(1)  # the next one is the newest then


async def happenings(tower: Tower) -> None:
    with tower.events() as events:
        async for event in events:
            match event:
                case ControlChanged(change=change, by=by):
                    print(f"drone {event.drone_id}: controls {change} by {by.name if by else 'the tower'}")
                case HoldStep(step=step, detail=detail):
                    print(f"drone {event.drone_id}: hold {step}: {detail}")
                case StatusText(text=text):
                    print(f"drone {event.drone_id} says: {text}")


async def main(for_s: float) -> None:
    async with Tower(rate_hz=2) as tower:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(for_s):
                await asyncio.gather(happenings(tower), *(positions(drone) for drone in tower.drones))


if __name__ == "__main__":
    asyncio.run(main(float(sys.argv[1])))
