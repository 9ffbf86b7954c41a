"""Takes off, looks around, and lands.

TOWER_URL=https://tower.example.org TOWER_TOKEN=twt_... python hello.py Kestrel
"""

import asyncio
import sys

from control_tower import ControlLost, Tower


async def main(name: str) -> None:
    async with Tower() as tower:
        drone = tower.drone(name)
        print(f"{tower.user.name} flies {drone.name}")
        async with drone.fly() as flight:
            for danger in await flight.loss_check():
                print(f"if the link is lost: {danger}")
            await flight.take_off(10)
            print(f"at {flight.telemetry.height_m:.1f} m")
            for heading_deg in (90, 180, 270, 0):
                await flight.turn(heading_deg)
            await flight.land()
        print(f"{drone.name} has landed, and the controls are free")


if __name__ == "__main__":
    try:
        asyncio.run(main(sys.argv[1]))
    except ControlLost as lost:
        sys.exit(f"the flight is over: {lost}")
