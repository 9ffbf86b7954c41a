"""A flight with the published MAVSDK-Python, written as its user would: one line for each step.

Run as `python mavsdk_flight.py ADDRESS GRPC_PORT` with MAVSDK on the path. It imports nothing from this repository.
Exits with status 0 only if every step succeeds.
"""

import asyncio
import sys
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

from mavsdk import System
from mavsdk.mission_raw import MissionItem

PLACE = (473_977_000, 85_456_000)
GO_TO = (47.39775, 8.54565)
STEP_WITHIN_S = 40.0
BEGAN_S = time.monotonic()


def say(step: str, *details: object) -> None:
    print(f"{time.monotonic() - BEGAN_S:6.1f} {step}", *details, flush=True)


async def until(stream: AsyncIterator[Any], condition: Callable[[Any], bool], step: str) -> None:
    async with asyncio.timeout(STEP_WITHIN_S):
        async for one in stream:
            if condition(one):
                say(step)
                return


async def fly(drone: System) -> None:
    await until(drone.core.connection_state(), lambda state: state.is_connected, "connected")
    async with asyncio.timeout(STEP_WITHIN_S):
        parameters = await drone.param.get_all_params()
    say("parameters", len(parameters.float_params) + len(parameters.int_params))
    await drone.param.set_param_float("WPNAV_SPEED", 640.0)
    assert await drone.param.get_param_float("WPNAV_SPEED") == 640.0
    say("parameter set")

    north, east = PLACE
    items = [
        MissionItem(number, 3, 16, int(number == 0), 1, 0, 2, 0, float("nan"), north + 400 * number, east, 15.0, 0)
        for number in range(60)
    ]
    async with asyncio.timeout(STEP_WITHIN_S):
        await drone.mission_raw.upload_mission(items)
        say("mission uploaded", len(items))
        back = await drone.mission_raw.download_mission()
    # On ArduPilot, slot 0 is home.
    assert [(one.x, one.y, one.z) for one in back[1:]] == [(one.x, one.y, one.z) for one in items[1:]]
    say("mission downloaded", len(back))

    await until(drone.telemetry.health(), lambda h: h.is_global_position_ok and h.is_armable, "ready")
    await drone.action.set_takeoff_altitude(8.0)
    await drone.action.arm()
    say("armed")
    await drone.action.takeoff()
    await until(drone.telemetry.position(), lambda at: at.relative_altitude_m > 7.5, "taken off")
    await drone.action.goto_location(*GO_TO, 488.0 + 11.0, 0.0)
    await until(
        drone.telemetry.position(),
        lambda at: abs(at.latitude_deg - GO_TO[0]) < 1e-5 and abs(at.longitude_deg - GO_TO[1]) < 1e-5,
        "gone to",
    )
    await drone.action.return_to_launch()
    await until(drone.telemetry.flight_mode(), lambda mode: str(mode) == "RETURN_TO_LAUNCH", "returning")
    await until(drone.telemetry.armed(), lambda armed: not armed, "returned and disarmed")


async def main() -> None:
    drone = System(port=int(sys.argv[2]))
    await asyncio.wait_for(drone.connect(system_address=sys.argv[1]), STEP_WITHIN_S)
    await fly(drone)


asyncio.run(main())
