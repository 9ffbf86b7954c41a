"""Vehicles that are watched only, driven and flown: nothing of ours may reach them, whoever is lost.

`python -m bench watched --vehicles FOLDER`: an ArduPilot tree with its simulators built (build/sitl/bin) and its
parameters (Tools/autotest). Rover, plane and VTOL, each in several situations with each receiver, lose their pilot in
each way in turn. A tap at the autopilot's port counts every stick, mode, set-point and command that came after it.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import shutil
import signal
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from bench.control_flown import EXPECTED
from bench.control_situations import ARM, SET_MODE
from bench.person import Refused, Sticks
from bench.real_autopilot import Airframe, Receiver
from bench.rig import HOME, wait_for
from bench.rows import Report
from bench.squadron import FlownDrone, Squadron, squadron_of
from bench.tap import AGENT

WATCHED_S: Final = 10.0
IN_FLIGHT_S: Final = 6.0
ANSWERED_S: Final = 0.5
"""What the pilot sent before the loss has certainly arrived."""
ASK_AGAIN_S: Final = 1.5
CRUISE: Final = Sticks(z=650)
_RC: Final = {f"RC{channel}_{end}": value for channel in range(1, 9) for end, value in (("MIN", 1000), ("MAX", 2000))}


@dataclass(frozen=True, slots=True)
class Situation:
    """`mode`: custom_mode at the end. `sticks`: of the pilot until the loss; None: none. `starts`: the mode in which it
    climbs first, and how high. `rests`: it stands, so that it must not move."""

    name: str
    mode: int
    sticks: Sticks | None = None
    rests: bool = False
    starts: tuple[int, float] | None = None
    mission: bool = False
    arms_in: int | None = None
    """If not in the vehicle's mode for it."""
    parameters: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Vehicle:
    name: str
    program: str
    airframe: Callable[[Path], Airframe]
    arms_in: int
    arming_sticks: Sticks
    situations: tuple[Situation, ...]


def _file(*names: str, model: str) -> Callable[[Path], Airframe]:
    return lambda tree: Airframe(
        model, {**_RC, "SIM_BARO_RND": 0}, tuple(tree / "Tools/autotest" / one for one in names)
    )


_MANUAL, _FBWA, _AUTO, _RTL, _TAKEOFF = 0, 5, 10, 11, 13
_QHOVER, _QLOITER, _QRTL, _GUIDED = 18, 19, 21, 15
REST: Final = Sticks(z=0)
_HOLD: Final = 4
_NOT_MANUAL: Final = {"INITIAL_MODE": 4.0, "MODE6": 4.0}
"""A rover that lets nobody out of MANUAL but its transmitter was met."""

VEHICLES: Final = (
    Vehicle(
        "rover",
        "ardurover",
        _file("default_params/rover.parm", model="rover"),
        _MANUAL,
        REST,  # a rover's throttle goes both ways: 0 is its middle
        (
            Situation("at rest", _MANUAL, rests=True),
            Situation("by hand", _MANUAL, Sticks(z=300)),
            Situation("AUTO", _AUTO, mission=True, arms_in=_HOLD, parameters=_NOT_MANUAL),
            Situation("RTL", _RTL, arms_in=_HOLD, parameters=_NOT_MANUAL),
        ),
    ),
    Vehicle(
        "plane",
        "arduplane",
        _file("models/plane.parm", model="plane"),
        _FBWA,
        REST,
        (
            Situation("on the ground", _FBWA, rests=True),
            Situation("by hand", _FBWA, CRUISE, starts=(_TAKEOFF, 40.0)),
            Situation("AUTO", _AUTO, mission=True, starts=(_TAKEOFF, 40.0)),
            Situation("RTL", _RTL, starts=(_TAKEOFF, 40.0)),
        ),
    ),
    Vehicle(
        "VTOL",
        "arduplane",
        _file("default_params/quadplane.parm", model="quadplane"),
        _QHOVER,
        REST,
        (
            Situation("on the ground", _QHOVER, rests=True),
            Situation("by hand", _QLOITER, Sticks(), starts=(_QLOITER, 15.0)),
            Situation("AUTO", _AUTO, mission=True, starts=(_QLOITER, 15.0)),
            Situation("QRTL", _QRTL, starts=(_QLOITER, 15.0)),
        ),
    ),
)


async def _take(drone: FlownDrone) -> None:
    await drone.order(drone.admin, "take")


async def _release(drone: FlownDrone) -> None:
    await drone.order(drone.operator, "release")


async def _browser_cut(drone: FlownDrone) -> None:
    await drone.operator.vanish()


async def _agent_killed(drone: FlownDrone) -> None:
    await drone.kill_agent()


LOSSES: Final = {"TAKE": _take, "release": _release, "browser cut": _browser_cut, "agent killed": _agent_killed}
TOGETHER: Final = ("line cut", "tower killed")
"""Of all drones at once: the tower is stopped for a while (nothing comes over the line), and killed."""


@dataclass
class Found:
    """`acts`: what reached the autopilot from agent and tower after the loss. `promises`: what REST or an event said
    that the vehicle would do. `untold`: it was not told as watched only."""

    acts: list[str]
    moved_m: float
    promises: list[str]
    untold: bool


async def run(report: Report, options: argparse.Namespace) -> None:
    """Rows for each vehicle, situation, receiver and loss. `options.cases`: only with A, or all of B+C, in the name."""
    wanted = [name.strip().split("+") for name in (options.cases or "").split(",") if name.strip()]
    folder = options.keep or Path(tempfile.mkdtemp(prefix="bench-"))
    losses = wrong = 0
    try:
        for vehicle in VEHICLES:
            for situation in vehicle.situations:
                name = f"{vehicle.name}, {situation.name}"
                if wanted and not any(all(part in name for part in parts) for parts in wanted):
                    continue
                made, bad = await _wave(report, options.vehicles, folder, vehicle, situation)
                losses, wrong = losses + made, wrong + bad
    finally:
        if options.keep is None:
            shutil.rmtree(folder, ignore_errors=True)
    report.add("watched only", "losses", losses, "count")
    report.add("watched only", "wrong", wrong, "count")
    report.say(f"[bold]{losses} losses, {wrong} wrong[/bold]")


async def _wave(report: Report, tree: Path, folder: Path, vehicle: Vehicle, situation: Situation) -> tuple[int, int]:
    """One situation with all receivers at once. Returns how many losses there were, and how many went wrong."""
    where = folder / f"{vehicle.name}-{situation.name}".replace(" ", "-")
    program = tree / "build/sitl/bin" / vehicle.program
    receivers = list(Receiver)
    losses = wrong = 0
    async with squadron_of(where, len(receivers), program, vehicle.airframe(tree)) as squadron:
        pairs = list(zip(squadron.drones, receivers, strict=True))
        ready = await asyncio.gather(
            *(_begin(drone, vehicle, situation, receiver) for drone, receiver in pairs), return_exceptions=True
        )
        flying = []
        for (drone, receiver), problem in zip(pairs, ready, strict=True):
            if problem is None:
                flying.append((drone, receiver))
            elif isinstance(problem, EXPECTED):
                report.say(f"  {vehicle.name}, {situation.name}, {receiver}: could not be flown: {problem}")
                report.add(f"{vehicle.name}, {situation.name}, {receiver}", "failed", 1, "count")
            else:
                raise problem
        for loss in (*LOSSES, *TOGETHER):
            found, lost = await _lose(squadron, [drone for drone, _ in flying], vehicle, situation, loss)
            for (_, receiver), one in zip(flying, found, strict=True):
                losses += 1
                bad = _judge(one, situation)
                wrong += bool(bad)
                case = f"{vehicle.name}, {situation.name}, {receiver}, {loss}"
                report.add(case, "frames_of_ours", len(one.acts), "count")
                report.add(case, "moved", one.moved_m, "m")
                report.say(
                    f"  {'WRONG' if bad else 'ok   '} {case}: {len(one.acts)} frames of ours, "
                    f"{one.moved_m:.2f} m{'; ' if bad else ''}{'; '.join(bad)}"
                )
            for drone, receiver in flying:
                if drone in lost:
                    case = f"{vehicle.name}, {situation.name}, {receiver}"
                    report.say(f"  {case}: could not go on after {loss}: {lost[drone]}")
                    report.add(case, "failed", 1, "count")
            flying = [one for one in flying if one[0] not in lost]
        for drone, receiver in flying:
            case = f"{vehicle.name}, {situation.name}, {receiver}"
            sticks = sum(stick.who == AGENT for stick in drone.tap.sticks)
            report.add(case, "sticks_of_the_agent_in_all", sticks, "count")
            if sticks:
                wrong += 1
                report.say(f"  WRONG {case}: {sticks} sticks of the agent in the whole flight")
            drone.write_down(case, drone.admin.now)
    return losses, wrong


def _judge(found: Found, situation: Situation) -> list[str]:
    bad = []
    if found.acts:
        bad.append(f"sent {', '.join(sorted(set(found.acts)))}")
    if found.promises:
        bad.append(f"promised {', '.join(sorted(set(found.promises)))}")
    if found.untold:
        bad.append("not told as watched only")
    return bad


async def _begin(drone: FlownDrone, vehicle: Vehicle, situation: Situation, receiver: Receiver) -> None:
    await drone.equip(receiver, situation.parameters)
    await drone.order(drone.operator, "acquire")
    if situation.mission:
        await _put_mission(drone)
    await _reach(drone, vehicle, situation)


async def _reach(drone: FlownDrone, vehicle: Vehicle, situation: Situation) -> None:
    """Armed, in the air if need be, and in the mode, with the pilot's sticks."""
    if not (drone.tap.modes and drone.tap.modes[-1].armed):
        await _into(drone, vehicle.arms_in if situation.arms_in is None else situation.arms_in)
        drone.operator.sticks = vehicle.arming_sticks
        await _ask_until(drone, "it to arm", lambda: drone.tap.modes[-1].armed, ARM, 1)
    if situation.starts is not None and drone.tap.motions[-1].alt_m < situation.starts[1] / 2:
        mode, height_m = situation.starts
        drone.operator.sticks = Sticks(z=1000)
        await _into(drone, mode)
        await wait_for("the height", lambda: drone.tap.motions[-1].alt_m > height_m, 90)
    drone.operator.sticks = situation.sticks or drone.operator.sticks
    await _into(drone, situation.mode)
    await asyncio.sleep(3.0 if situation.sticks is not None else 1.0)
    if situation.sticks is None:
        drone.operator.sticks = None
        await asyncio.sleep(1.0)


async def _into(drone: FlownDrone, mode: int) -> None:
    await _ask_until(drone, f"mode {mode}", lambda: drone.tap.modes[-1].custom_mode == mode, SET_MODE, 1, mode)


async def _ask_until(drone: FlownDrone, what: str, done: Callable[[], bool], *command: float) -> None:
    asked_at = 0.0

    async def look() -> bool:
        nonlocal asked_at
        if drone.tap.modes and done():
            return True
        if drone.operator.now - asked_at > ASK_AGAIN_S:
            asked_at = drone.operator.now
            await drone.operator.command(int(command[0]), *command[1:])
        return False

    try:
        await wait_for(what, look, 60)
    except TimeoutError as error:
        assert drone.autopilot is not None
        said = [text for _, text in drone.autopilot.truth.texts[-4:]]
        raise TimeoutError(f"{error}; it said: {said}") from None


async def _put_mission(drone: FlownDrone) -> None:
    """A long way up and down the field."""
    rows: list[list[object]] = []
    for number in range(6):
        north_e7 = 60_000 if number % 2 == 0 else 10_000
        rows.append([16, 3, [0, 0, 0, 0], round(HOME[0] * 1e7) + north_e7, round(HOME[1] * 1e7), 40, 1])
    put = await drone.operator.ask("PUT", f"/drones/{drone.drone_id}/mission", {"items": rows})
    if put["state"] != "done":
        raise RuntimeError(f"the mission was not taken: {put}")


async def _lose(
    squadron: Squadron, drones: Sequence[FlownDrone], vehicle: Vehicle, situation: Situation, loss: str
) -> tuple[list[Found], dict[FlownDrone, str]]:
    """Loses the pilot of all of them in this way, watches, and brings everything back. Also returns those with which
    that did not succeed, and why."""
    watched_s = WATCHED_S if situation.rests else IN_FLIGHT_S
    for drone in drones:
        drone.operator.sticks = None
    await asyncio.sleep(ANSWERED_S)
    at = squadron.admin.now
    places = [drone.tap.motions[-1] for drone in drones]
    if loss == "line cut":
        squadron.tower.send_signal(signal.SIGSTOP)
    elif loss == "tower killed":
        squadron.tower.kill()
        await squadron.tower.wait()
    else:
        await asyncio.gather(*(LOSSES[loss](drone) for drone in drones))
    await wait_for("the watch to end", lambda: squadron.admin.now >= at + watched_s, watched_s + 30)
    if loss == "line cut":
        squadron.tower.send_signal(signal.SIGCONT)
    elif loss == "tower killed":
        await squadron.start_tower()
    ended = squadron.admin.now
    found = [
        await _found(drone, at, ended, (place.north_m, place.east_m), told=loss not in TOGETHER)
        for drone, place in zip(drones, places, strict=True)
    ]
    mended = await asyncio.gather(*(_mend(drone, vehicle, situation, loss) for drone in drones), return_exceptions=True)
    for problem in mended:
        if problem is not None and not isinstance(problem, EXPECTED):
            raise problem
    lost = {drone: str(problem) for drone, problem in zip(drones, mended, strict=True) if problem is not None}
    return found, lost


async def _found(drone: FlownDrone, at: float, ended: float, place: tuple[float, float], *, told: bool) -> Found:
    acts = [act.what for act in drone.tap.acts if at < act.at <= ended]
    last = next(motion for motion in reversed(drone.tap.motions) if motion.at <= ended)
    promises = []
    for _, event in drone.events_since(drone.admin, at):
        hold: dict[str, Any] | None = event["drone"].get("hold") if event["type"] == "drone" else None
        if hold is not None and hold.get("action"):
            promises.append(f"{hold['phase']} {hold['action']}")
        if event["type"] == "hold" and event["step"] == "confirmed":
            promises.append("a confirmed hold")
    untold = told and not await _says_watched_only(drone)
    moved_m = math.hypot(last.north_m - place[0], last.east_m - place[1])
    return Found(acts, moved_m, promises, untold)


async def _says_watched_only(drone: FlownDrone) -> bool:
    """In the drone's view, and in the check before flight."""
    check = await drone.admin.ask("GET", f"/drones/{drone.drone_id}/loss-check")
    words = " ".join(sentence["text"] for sentence in check["sentences"])
    return bool((await drone.view())["watched_only"]) and "watched only" in words


async def _mend(drone: FlownDrone, vehicle: Vehicle, situation: Situation, loss: str) -> None:
    """The operator has the controls again, and the vehicle is where it was."""
    if loss == "agent killed":
        await drone.start_agent()
    if loss in TOGETHER and loss != TOGETHER[0]:
        return  # the last of all

    async def online() -> bool:
        try:
            drone_now = await drone.view()
        except EXPECTED:
            return False
        return bool(drone_now["online"] and drone_now["autopilot_heard"])

    await wait_for("the drone to be online", online, 60)
    await drone.free()
    try:
        await drone.order(drone.operator, "acquire")
    except Refused:
        return
    if situation.sticks is not None or situation.starts is not None:
        drone.operator.sticks = situation.sticks or Sticks()
        await _reach(drone, vehicle, situation)
