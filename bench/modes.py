"""Every mode that the console offers for a copter: 60 s without sticks, with the receiver's throttle at rest.

`python -m bench modes --autopilot PATH`. The pilot hovers by hand through tower and agent, commands the mode, and sends
no stick from then on; the browser stays. Where is the drone after a minute, and what was everybody told before that?
"""

from __future__ import annotations

import argparse
import asyncio
import math
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.control_flown import EXPECTED, PATIENT, TRIES, USUAL
from bench.control_situations import put_mission, set_mode, take_off
from bench.control_verdict import COMES_DOWN, GROUND_M, MODE_NAMES, SUNK_M
from bench.person import Sticks
from bench.real_autopilot import Receiver
from bench.rig import wait_for
from bench.rows import Report
from bench.squadron import FlownDrone, squadron_of
from bench.told import Told, in_short, told
from wire.autopilots.arducopter import PROFILE
from wire.autopilots.profile import FlightMode

HEIGHT_M: Final = 25.0
WATCHED_S: Final = 60.0
DRONES: Final = 3
OFFERED: Final = tuple(mode for mode in PROFILE.modes if mode.offered and mode.settable)


@dataclass(frozen=True, slots=True)
class Minute:
    """`kept_m`: the lowest before it came down. `returned_s`: when it began to; NaN: never. `ground_s`: when it
    touched the ground. `modes`: all that its heartbeats showed, in order."""

    began_m: float
    kept_m: float
    returned_s: float
    ended_m: float
    ground_s: float
    modes: tuple[str, ...]
    told: tuple[Told, ...]

    @property
    def untold(self) -> bool:
        """It came down before anybody was told, or sank in a mode that keeps its height."""
        came_down = not math.isnan(self.ground_s) or not math.isnan(self.returned_s) or self.sank
        return self.sank or (came_down and not self.told)

    @property
    def sank(self) -> bool:
        return self.kept_m < self.began_m - SUNK_M


async def run(report: Report, options: argparse.Namespace) -> None:
    """One row of figures for each mode. `options.cases`: only modes with one of these names."""
    names = [name.strip() for name in (options.cases or "").split(",") if name.strip()]
    waiting = [mode for mode in OFFERED if not names or mode.name in names]
    folder = options.keep or Path(tempfile.mkdtemp(prefix="bench-"))
    try:
        async with squadron_of(
            folder / "modes", min(options.drones or DRONES, len(waiting)), options.autopilot
        ) as squadron:

            async def fly(drone: FlownDrone) -> None:
                while waiting:
                    await _attempt(report, drone, waiting.pop(0))

            await asyncio.gather(*(fly(drone) for drone in squadron.drones))
    finally:
        if options.keep is None:
            shutil.rmtree(folder, ignore_errors=True)


async def _attempt(report: Report, drone: FlownDrone, mode: FlightMode) -> None:
    try:
        found = await _tried(drone, mode)
    except EXPECTED as error:
        report.say(f"  {mode.name}: could not be flown: {type(error).__name__}: {error}")
        report.add(mode.name, "failed", 1, "count")
        return
    add = report.add
    for metric, value, unit in (
        ("height_at_first", found.began_m, "m"),
        ("lowest_before_return", found.kept_m, "m"),
        ("returns_after", found.returned_s, "s"),
        ("height_after_60_s", found.ended_m, "m"),
        ("ground_after", found.ground_s, "s"),
        ("first_told_after", found.told[0].at if found.told else math.nan, "s"),
    ):
        if not math.isnan(value):
            add(mode.name, metric, value, unit)
    add(mode.name, "untold", float(found.untold), "count")
    ground = "" if math.isnan(found.ground_s) else f", ground after {found.ground_s:.1f} s"
    report.say(
        f"  {'UNTOLD' if found.untold else 'ok    '} {mode.name}: {found.began_m:.1f} m, kept {found.kept_m:.1f}, "
        f"after 60 s {found.ended_m:.1f} m{ground}; {' > '.join(found.modes)}; {in_short(found.told)}"
    )


async def _tried(drone: FlownDrone, mode: FlightMode) -> Minute:
    """On a busy machine a take-off may fail. Raises the last problem."""
    for left in reversed(range(TRIES)):
        try:
            return await _minute(drone, mode)
        except EXPECTED:
            if not left:
                raise
    raise AssertionError("unreachable")


async def _minute(drone: FlownDrone, mode: FlightMode) -> Minute:
    await drone.equip(Receiver.LOW, {})
    settings = f"/drones/{drone.drone_id}/settings"
    await drone.admin.ask("PATCH", settings, {"lost_action": "return", **PATIENT})
    if mode.flies_mission:
        await put_mission(drone)
    await take_off(drone, HEIGHT_M)
    await drone.admin.ask("PATCH", settings, USUAL)
    drone.operator.sticks = Sticks()
    await set_mode(drone, mode.custom_mode)
    drone.operator.sticks = None
    at = drone.operator.now
    await wait_for("a minute to pass", lambda: drone.operator.now >= at + WATCHED_S, WATCHED_S + 30)
    heights = [(one.at - at, one.alt_m) for one in drone.tap.motions if one.at >= at]
    shown: list[str] = []
    returned_s = math.nan
    for seen in drone.tap.modes:
        if seen.at < at:
            continue
        if seen.custom_mode in COMES_DOWN and math.isnan(returned_s):
            returned_s = seen.at - at
        name = MODE_NAMES.get(seen.custom_mode, PROFILE.mode_name(seen.custom_mode))
        if not shown or shown[-1] != name:
            shown.append(name)
    drone.write_down(f"60 s in {mode.name}", at)
    heard = told(drone, drone.admin, at)
    promise = [Told(0.0, "mode", mode.name)] if mode.custom_mode in COMES_DOWN else []
    until = WATCHED_S if math.isnan(returned_s) else returned_s
    return Minute(
        began_m=heights[0][1],
        kept_m=min((height for seconds, height in heights if seconds <= until), default=heights[0][1]),
        returned_s=returned_s,
        ended_m=heights[-1][1],
        ground_s=next((seconds for seconds, height in heights if height < GROUND_M), math.nan),
        modes=tuple(shown),
        told=(*promise, *heard),
    )
