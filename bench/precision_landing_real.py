"""The landings of `precision_landing` with a real ArduCopter in its own simulator: same pictures, same detector, same
sender. What it did is read from its true motion, which the sender does not see."""

from __future__ import annotations

import asyncio
import contextlib
import math
import random
import tempfile
from pathlib import Path
from typing import Any, Final

from bench.precision_landing import HEIGHT_M, MAX_BESIDE_M, MAX_WIND_MPS, MIN_WIND_MPS, Eyes, Landing
from bench.real_autopilot import RealAutopilot, Receiver, flying
from bench.rig import HOME, wait_for
from simulator.camera.pads import LandingPad
from simulator.camera.view import Pose
from wire.dialect import mavlink

M: Final = mavlink
GUIDED, LAND = 4, 9
SIM_STATE: Final = 108
CAMERA_HZ: Final = 10.0
CONSTANT: Final = 1
"""SIM_WIND_T: the wind is the same at every height. 0 would leave 45 % of it at 12 m, and nothing at the ground."""
_EARTH_M: Final = 6_378_137.0
MAX_LANDING_S: Final = 150.0


def pose_of(state: Any) -> Pose:
    """Returns the pose in SIM_STATE, in metres from HOME."""
    lat = state.lat_int * 1e-7 if getattr(state, "lat_int", 0) else state.lat
    lon = state.lon_int * 1e-7 if getattr(state, "lon_int", 0) else state.lon
    north_m = math.radians(lat - HOME[0]) * _EARTH_M
    east_m = math.radians(lon - HOME[1]) * _EARTH_M * math.cos(math.radians(HOME[0]))
    return Pose(north_m, east_m, state.alt - HOME[2], (state.q1, state.q2, state.q3, state.q4))


async def land_all(binary: Path, seed: int, count: int) -> list[Landing]:
    """Flies so many landings, one after the other, with one ArduCopter."""
    folder = Path(tempfile.mkdtemp(prefix="precision-landing-"))
    parameters = {"PLND_ENABLED": 1, "PLND_TYPE": 1, "PLND_LAG": 0.1, "SIM_WIND_T": CONSTANT}
    async with flying(binary, folder, receiver=Receiver.LOW, parameters=parameters) as autopilot:
        return [await _land(autopilot, seed, number) for number in range(count)]


async def _land(autopilot: RealAutopilot, seed: int, number: int) -> Landing:
    truth = autopilot.truth
    source = random.Random(f"real {seed} {number}")
    wind_mps = source.uniform(MIN_WIND_MPS, MAX_WIND_MPS)
    await truth.set_parameter("SIM_WIND_SPD", round(wind_mps, 2))
    await truth.set_parameter("SIM_WIND_DIR", round(source.uniform(0.0, 359.0)))
    await truth.set_parameter("SIM_WIND_TURB", 1)
    pad = LandingPad(12.0 + source.uniform(-5, 5), -8.0 + source.uniform(-5, 5), source.uniform(0.0, 360.0))
    beside_m, towards = MAX_BESIDE_M * math.sqrt(source.random()), source.uniform(0.0, math.tau)
    north_m, east_m = pad.north_m + beside_m * math.cos(towards), pad.east_m + beside_m * math.sin(towards)
    lat = HOME[0] + math.degrees(north_m / _EARTH_M)
    lon = HOME[1] + math.degrees(east_m / _EARTH_M / math.cos(math.radians(HOME[0])))
    await _command(autopilot, M.MAV_CMD_DO_SET_MODE, 1, GUIDED)
    await _command(autopilot, M.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    await _command(autopilot, M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, HEIGHT_M)
    await wait_for("the take-off", lambda: truth.alt_m > HEIGHT_M - 0.7, 60)
    go = M.MAVLink_command_int_message(
        1, 1, 6, M.MAV_CMD_DO_REPOSITION, 0, 0, -1, 1, 0, math.nan, round(lat * 1e7), round(lon * 1e7), HEIGHT_M
    )
    truth.send(go)
    await asyncio.sleep(15.0)
    truth.command(M.MAV_CMD_SET_MESSAGE_INTERVAL, SIM_STATE, 20_000)
    await asyncio.sleep(1.0)
    here = pose_of(truth.state)
    eyes = Eyes(pad, number + 1)
    landing = Landing(math.nan, math.hypot(here.north_m - pad.north_m, here.east_m - pad.east_m), wind_mps)
    await _command(autopilot, M.MAV_CMD_DO_SET_MODE, 1, LAND)
    loop = asyncio.get_running_loop()
    until = loop.time() + MAX_LANDING_S
    while truth.armed:
        if loop.time() > until:
            raise RuntimeError(f"landing {number} never ended: {truth.texts[-5:]}")
        began = loop.time()
        target = await asyncio.to_thread(eyes.look, pose_of(truth.state), truth.state_at, landing)
        if target is not None:
            eyes.sender.saw(target, target.time_usec / 1e6)
        for frame in eyes.sender.due(1, loop.time()):
            truth.send_frame(frame)
            landing.sent += 1
        await asyncio.sleep(max(1.0 / CAMERA_HZ - (loop.time() - began), 0.0))
    there = pose_of(truth.state)
    landing.beside_m = math.hypot(there.north_m - pad.north_m, there.east_m - pad.east_m)
    return landing


async def _command(autopilot: RealAutopilot, number: int, *params: float) -> None:
    """Asks until it is accepted: an answer may be lost among the pictures' poses."""
    for _ in range(10):
        with contextlib.suppress(TimeoutError):
            if await autopilot.truth.ask(number, *params, within_s=1.0) == M.MAV_RESULT_ACCEPTED:
                return
        await asyncio.sleep(0.2)
    raise RuntimeError(f"{number} is refused: {autopilot.truth.texts[-3:]}")
