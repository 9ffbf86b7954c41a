"""A typical MAVSDK-Python program, for timing: it executes commands from standard input, line by line.

Run as `python mavsdk_program.py ADDRESS GRPC_PORT` by a Python that has MAVSDK; it imports nothing of this repository.
Each line in is JSON: {"do": "parameters"} | {"do": "upload", "items": rows} | {"do": "download"}; rows are the plan's,
without home. Each line out: {"s": seconds, ...} or {"failed": words}. The first reports the connection.
"""

import asyncio
import json
import sys
import time
from typing import Any

from mavsdk import System
from mavsdk.mission_raw import MissionItem

HOME_SLOT = MissionItem(0, 0, 16, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0)
"""ArduPilot keeps home in slot 0; so does this program."""

Row = list[Any]


def item(seq: int, row: Row) -> MissionItem:
    command, frame, params, x, y, z, autocontinue = row
    return MissionItem(seq, frame, command, int(seq == 1), autocontinue, *map(float, params), x, y, z, 0)


def row(one: MissionItem) -> Row:
    params = [one.param1, one.param2, one.param3, one.param4]
    return [one.command, one.frame, params, one.x, one.y, one.z, one.autocontinue]


async def connected(drone: System) -> dict[str, Any]:
    async for state in drone.core.connection_state():
        if state.is_connected:
            break
    return {"connected": True}


async def parameters(drone: System, _: dict[str, Any]) -> dict[str, Any]:
    found = await drone.param.get_all_params()
    return {"count": len(found.float_params) + len(found.int_params) + len(found.custom_params)}


async def upload(drone: System, said: dict[str, Any]) -> dict[str, Any]:
    await drone.mission_raw.upload_mission([HOME_SLOT, *(item(n, one) for n, one in enumerate(said["items"], start=1))])
    return {}


async def download(drone: System, _: dict[str, Any]) -> dict[str, Any]:
    return {"items": [row(one) for one in (await drone.mission_raw.download_mission())[1:]]}


RESPONSES = {"parameters": parameters, "upload": upload, "download": download}


async def timed(action: Any) -> None:
    began = time.monotonic()
    try:
        found = await action
        found["s"] = time.monotonic() - began
    except Exception as error:  # of any kind: it is reported, and counts as a result
        found = {"failed": f"{type(error).__name__}: {error}"}
    print(json.dumps(found), flush=True)


async def main() -> None:
    drone = System(port=int(sys.argv[2]))
    await drone.connect(system_address=sys.argv[1])
    await timed(connected(drone))
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        said = json.loads(line)
        await timed(RESPONSES[said["do"]](drone, said))


asyncio.run(main())
