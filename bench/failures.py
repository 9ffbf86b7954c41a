"""Failures injected into a real copter's simulator: what its pilot reads, and after how many seconds.

`python -m bench failures --autopilot PATH`. Each is injected while the pilot hovers by hand at HEIGHT_M with a browser
open; those of the line on the ground too. Counted from the injection; a fall is seen when it falls.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import shutil
import tempfile
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from bench.autopilot_tap import AutopilotTap
from bench.control_flown import EXPECTED, PATIENT, TRIES, USUAL
from bench.control_situations import take_off
from bench.real_autopilot import RealAutopilot, Receiver
from bench.rig import HOME, wait_for
from bench.rows import Report
from bench.squadron import FlownDrone, squadron_of
from bench.told import Told, first, in_short, told
from bench.truth import Truth
from wire.dialect import build, mavlink

HEIGHT_M: Final = 40.0
WATCHED_S: Final = 25.0
DRONES: Final = 3
MOTOR_STOP, SWITCH_HIGH = 31, 2
SECOND: Final = 2
"""The system id of the other autopilot."""


@dataclass(frozen=True, slots=True)
class Failure:
    """`told_by`: the alerts of which at least one must come."""

    name: str
    inject: Callable[[FlownDrone], Awaitable[None]]
    told_by: tuple[str, ...]
    in_flight: bool = True
    on_second: bool = False
    parameters: dict[str, float] = field(default_factory=dict)
    watched_s: float = WATCHED_S


def _truth(drone: FlownDrone) -> Truth:
    assert isinstance(drone.autopilot, RealAutopilot)
    return drone.autopilot.truth


async def _stop_motors(drone: FlownDrone) -> None:
    """As by a switch: armed, and no motor turns."""
    _truth(drone).command(mavlink.MAV_CMD_DO_AUX_FUNCTION, MOTOR_STOP, SWITCH_HIGH)


def _set(**values: float) -> Callable[[FlownDrone], Awaitable[None]]:
    async def inject(drone: FlownDrone) -> None:
        for name, value in values.items():
            await _truth(drone).set_parameter(name, value)

    return inject


async def _force_disarm(drone: FlownDrone) -> None:
    _truth(drone).disarm()


async def _cut_the_way_down(drone: FlownDrone) -> None:
    drone.tap.is_cut = True


async def _sign(drone: FlownDrone) -> None:
    """Somebody else sets up a key that the agent does not have."""
    message: Any = mavlink.MAVLink_setup_signing_message(1, 1, bytes(range(32)), 1)
    _truth(drone).send(message, system_id=255, component_id=190)


async def _another_system(drone: FlownDrone) -> None:
    """Heartbeats and positions of a second autopilot on the line."""
    tap = drone.tap
    assert isinstance(tap, AutopilotTap)
    place = round((HOME[0] + 1) * 1e7), round(HOME[1] * 1e7), 500_000, 0
    messages: tuple[Any, ...] = (
        mavlink.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3),
        mavlink.MAVLink_global_position_int_message(1, *place, 0, 0, 0, 0),
    )

    async def go_on() -> None:
        for number in range(round(WATCHED_S)):
            for message in messages:
                tap.inject(build(message, system_id=SECOND, component_id=1, sequence=number))
            await asyncio.sleep(1.0)

    _GOING_ON.append(asyncio.create_task(go_on()))


_GOING_ON: Final[list[asyncio.Task[None]]] = []
_FALL: Final = ("falls", "crashed")
_DEAF: Final = ("deaf-autopilot", "wrong-signing-key")

FAILURES: Final = (
    Failure("all motors", _stop_motors, _FALL),
    Failure("one motor", _set(SIM_ENGINE_FAIL=1, SIM_ENGINE_MUL=0), _FALL),
    Failure("flip", _set(ATC_RAT_RLL_P=-0.5), _FALL),
    Failure("force disarm", _force_disarm, _FALL),
    Failure("GPS", _set(SIM_GPS1_ENABLE=0), ("gps", "estimator")),
    Failure("compass", _set(SIM_MAG1_FAIL=1, SIM_MAG2_FAIL=1, SIM_MAG3_FAIL=1), ("estimator", "sensor")),
    Failure("EKF", _set(SIM_GPS1_GLTCH_X=0.005), ("estimator",)),
    Failure(
        "battery",
        _set(SIM_BATT_VOLTAGE=9.8),
        ("battery-low", "battery-critical"),
        watched_s=40.0,
        parameters={"BATT_LOW_VOLT": 10.5},
    ),
    Failure("way down cut", _cut_the_way_down, _DEAF),
    Failure("signing", _sign, _DEAF, in_flight=False, on_second=True),
    Failure("second system", _another_system, ("other-autopilot",)),
)


async def run(report: Report, options: argparse.Namespace) -> None:
    """Rows: seconds until each alert of each failure; `untold`: none of those that must come came."""
    names = [name.strip() for name in (options.cases or "").split(",") if name.strip()]
    waiting = [one for one in FAILURES if not names or one.name in names]
    folder = options.keep or Path(tempfile.mkdtemp(prefix="bench-"))
    try:
        count = min(options.drones or DRONES, len(waiting))
        async with squadron_of(folder / "failures", count, options.autopilot) as squadron:

            async def fly(drone: FlownDrone) -> None:
                while waiting:
                    await _attempt(report, drone, waiting.pop(0))

            await asyncio.gather(*(fly(drone) for drone in squadron.drones))
    finally:
        if options.keep is None:
            shutil.rmtree(folder, ignore_errors=True)


async def _attempt(report: Report, drone: FlownDrone, failure: Failure) -> None:
    try:
        heard = await _tried(drone, failure)
    except EXPECTED as error:
        report.say(f"  {failure.name}: could not be flown: {type(error).__name__}: {error}")
        report.add(failure.name, "failed", 1, "count")
        return
    seconds = first(heard, *failure.told_by)
    report.add(failure.name, "untold", float(math.isnan(seconds)), "count")
    for one in heard:
        report.add(failure.name, one.code.replace(" ", "_"), one.at, "s")
    report.say(f"  {'UNTOLD' if math.isnan(seconds) else f'{seconds:5.1f}s'} {failure.name}: {in_short(heard, 9)}")
    for one in heard:
        report.say(f"          {one.at:5.1f} s {one.code}: {one.words}")


async def _tried(drone: FlownDrone, failure: Failure) -> list[Told]:
    """On a busy machine a take-off may fail. Raises the last problem."""
    for left in reversed(range(TRIES)):
        try:
            return await _fail(drone, failure)
        except EXPECTED:
            if not left:
                raise
    raise AssertionError("unreachable")


async def _fail(drone: FlownDrone, failure: Failure) -> list[Told]:
    await drone.equip(Receiver.LOW, failure.parameters, agent_on_second=failure.on_second)
    settings = f"/drones/{drone.drone_id}/settings"
    await drone.admin.ask("PATCH", settings, {"lost_action": "return", **PATIENT})
    if failure.in_flight:
        await take_off(drone, HEIGHT_M)
        await drone.admin.ask("PATCH", settings, USUAL)
    else:
        await _settled(drone)
    at = drone.admin.now
    await failure.inject(drone)
    await wait_for("the watch to end", lambda: drone.admin.now >= at + failure.watched_s, failure.watched_s + 30)
    drone.write_down(failure.name, at)
    return told(drone, drone.admin, at)


async def _settled(drone: FlownDrone) -> None:
    """The autopilot has answered the agent, so a failure to do so is news."""

    async def answers() -> bool:
        return bool((await drone.view())["hears_agent"])

    await wait_for("the autopilot to answer the agent", answers, 60)
