"""How soon a hold begins and how far the drone drifts, with a real autopilot (or tower-sim) and several drones at once.

take_race      TAKE at 0, 50 ... 1000 ms after arm, and after take-off: is it held, and how soon?
ordered_hold   from the admin's TAKE at full stick to the hold's mode at the autopilot's port; the old holder's
               frames after it
drift          distance from 8 m/s after the beginning of stage two
round_trip     the line becomes 400 ms slower each way at full stick: time until the hold's mode is reported
"""

from __future__ import annotations

import argparse
import asyncio
import math
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Final

import httpx

from bench.control_situations import ARM as ARM_COMMAND
from bench.control_situations import GUIDED, LOITER, TAKE_OFF, arm, set_mode, take_off
from bench.control_verdict import DRIFT_FOR_S, HOLDS, STAYS
from bench.delayed_line import HOST, DelayedLine, delayed_line
from bench.hand_flight import AXES
from bench.hold_figures import began_at
from bench.person import Refused, Sticks
from bench.real_autopilot import NoAutopilot, Receiver
from bench.rig import HOME, wait_for
from bench.rows import Report, percentile
from bench.squadron import FlownDrone, Squadron, squadron_of
from bench.tap import OPERATOR
from wire.dialect import mavlink

CASES: Final = ("take_race", "ordered_hold", "drift", "round_trip")
RACE_MS: Final = tuple(range(0, 1001, 50))
ROUNDS: Final = 10
DRONES: Final = 4
FIELD_M: Final = 30.0
SLOWER_S: Final = 0.4
HELD_BY_S: Final = 5.0
CLIMBED_M: Final = 6.0
_GROUND_HOLDS: Final = HOLDS - {GUIDED}
"""Take-offs use GUIDED."""
_EXPECTED: Final = (Refused, NoAutopilot, TimeoutError, OSError, RuntimeError, httpx.TransportError)


async def time_holds(report: Report, options: argparse.Namespace, folder: Path, cases: Sequence[str]) -> None:
    """Runs the cases of CASES that are named."""
    count = options.drones or DRONES
    work: dict[str, Callable[[Squadron, Report, int], Awaitable[None]]] = {
        "take_race": _take_race,
        "ordered_hold": _ordered_hold,
        "drift": _drift,
        "round_trip": _round_trip,
    }
    rounds = options.rounds or ROUNDS
    for name in cases:
        async with squadron_of(folder / name, count, options.autopilot) as squadron:
            await work[name](squadron, report, rounds)


def _receiver_of(drone: FlownDrone) -> Receiver:
    kinds = tuple(Receiver)
    return kinds[drone.drone_id % len(kinds)]


async def _take_race(squadron: Squadron, report: Report, _rounds: int) -> None:
    waiting = [(what, delay_ms) for delay_ms in RACE_MS for what in ("arm", "take-off")]
    found: dict[str, list[float]] = {"arm": [], "take-off": []}
    wrong: list[str] = []
    never_armed = dict.fromkeys(found, 0)

    async def race(drone: FlownDrone) -> None:
        await drone.equip(_receiver_of(drone), {})
        while waiting:
            what, delay_ms = waiting.pop(0)
            try:
                seconds, problem = await _one_race(drone, what, delay_ms / 1000)
            except _EXPECTED as error:
                problem, seconds = f"{type(error).__name__}: {error}", math.nan
            if problem:
                words = f"TAKE {delay_ms} ms after {what}, {_receiver_of(drone)}: {problem}"
                report.say(f"  WRONG {words}")
                wrong.append(words)
            elif math.isnan(seconds):
                never_armed[what] += 1
            else:
                found[what].append(seconds * 1e3)
            try:
                await _back_on_the_ground(drone)
            except _EXPECTED as error:
                report.say(f"  a fresh autopilot: {error}")
                await drone.equip(_receiver_of(drone), {})

    await asyncio.gather(*(race(drone) for drone in squadron.drones))
    for what, times in found.items():
        case = f"take_race, after {what}"
        report.spread(case, "first_armed_heartbeat_to_hold", times, "ms")
        report.add(case, "never_armed", never_armed[what], "count")
        worst = max(times, default=math.nan)
        report.say(f"  {case}: {len(times)} held, p50 {percentile(times, 0.5):.0f}, worst {worst:.0f} ms")
    report.add("take_race", "wrong", len(wrong), "count")


async def _one_race(drone: FlownDrone, what: str, delay_s: float) -> tuple[float, str]:
    """Returns (seconds from the first armed heartbeat, or from the TAKE if that was later, to the hold; what was
    wrong). NaN if it never armed."""
    pilot, tap = drone.operator, drone.tap
    if what == "arm":
        await _ready_to_arm(drone)
        await pilot.command(ARM_COMMAND, 1)
    else:
        await arm(drone)
        await pilot.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, FIELD_M)
    since = pilot.now
    await asyncio.sleep(delay_s)
    asked_at = pilot.now
    taking = asyncio.create_task(drone.order(drone.admin, "take"))
    if what == "arm":
        await pilot.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, FIELD_M)
    await taking
    # A take-off spools up for two seconds before lift-off.
    until = asked_at + HELD_BY_S + 1.0
    await wait_for("what comes of it", lambda: pilot.now > until, HELD_BY_S + 10)
    armed_at = next((seen.at for seen in tap.modes if seen.armed and seen.at >= since - 2.0), None)
    held_at = next((seen.at for seen in tap.modes if seen.at >= asked_at and seen.custom_mode in _GROUND_HOLDS), None)
    height_m = max(motion.alt_m for motion in tap.motions if motion.at >= asked_at)
    if height_m > CLIMBED_M:
        return math.nan, f"it climbed to {height_m:.1f} m"
    if armed_at is None:
        return math.nan, ""
    if held_at is None:
        return math.nan, f"armed and not held; mode {tap.modes[-1].custom_mode}, armed {tap.modes[-1].armed}"
    return held_at - max(armed_at, asked_at), ""


async def _ready_to_arm(drone: FlownDrone) -> None:
    pilot = drone.operator
    pilot.sticks = Sticks()
    await drone.order(pilot, "acquire")
    await drone.acknowledge_losses()
    await set_mode(drone, GUIDED)
    pilot.sticks = Sticks(z=0)
    await asyncio.sleep(0.5)


async def _back_on_the_ground(drone: FlownDrone) -> None:
    drone.operator.sticks = None
    tap = drone.tap
    asked_at = 0.0

    def down() -> bool:
        nonlocal asked_at
        if not tap.modes[-1].armed and tap.motions[-1].alt_m < 0.3:
            return True
        if drone.operator.now - asked_at > 1.0:
            asked_at = drone.operator.now
            drone.disarm()
        return False

    await wait_for("it to lie on the ground", down, 20)
    await drone.free()
    tap.forget()
    await asyncio.sleep(2.0)


async def _by_hand(drone: FlownDrone) -> None:
    """After a TAKE: given back and accepted, then manual flight in LOITER with centred sticks."""
    view = await drone.view()
    drone.operator.sticks = Sticks()
    if view["holder"] is not None and view["holder"]["name"] == "admin":
        await drone.order(drone.admin, "give")
        await drone.order(drone.operator, "accept", sticks_centred=True)
    await asyncio.sleep(0.5)
    await set_mode(drone, LOITER)


async def _home(drone: FlownDrone) -> None:
    """Flies guided to the middle of the field; then by hand."""
    pilot, tap = drone.operator, drone.tap
    await _by_hand(drone)
    await set_mode(drone, GUIDED)
    x, y = round(HOME[0] * 1e7), round(HOME[1] * 1e7)
    asked_at = 0.0

    async def there() -> bool:
        nonlocal asked_at
        last = tap.motions[-1]
        if math.hypot(last.north_m, last.east_m) < 4 and abs(last.alt_m - FIELD_M) < 1 and last.speed_mps < 0.4:
            return True
        if pilot.now - asked_at > 2.0:
            asked_at = pilot.now
            go = mavlink.MAV_CMD_DO_REPOSITION
            await pilot.send(
                mavlink.MAVLink_command_int_message(1, 1, 0, go, 0, 0, -1, 1, 0, 0, x, y, HOME[2] + FIELD_M)
            )
        return False

    await wait_for("the way home", there, 120)
    await set_mode(drone, LOITER)


async def _in_the_air(drone: FlownDrone) -> None:
    await drone.equip(_receiver_of(drone), {})
    await take_off(drone, FIELD_M)


async def _each(squadron: Squadron, report: Report, case: str, fly: Callable[[FlownDrone], Awaitable[None]]) -> None:
    """Runs all drones at once; one that cannot continue is a row of its own."""

    async def one(drone: FlownDrone) -> None:
        try:
            await fly(drone)
        except _EXPECTED as error:
            report.say(f"  {case}: {drone.name} gave up: {type(error).__name__}: {error}")
            report.add(case, "given_up", 1, "count")

    await asyncio.gather(*(one(drone) for drone in squadron.drones))


async def _ordered_hold(squadron: Squadron, report: Report, rounds: int) -> None:
    to_mode: list[float] = []
    at_agent: list[float] = []
    foreign: list[int] = []
    axes = list(AXES.values())

    async def fly(drone: FlownDrone) -> None:
        await _in_the_air(drone)
        for number in range(rounds):
            drone.operator.sticks = axes[(number + drone.drone_id) % len(axes)]
            # Out of phase with anything that runs once per second.
            await asyncio.sleep(0.5 + (number * 0.618 + drone.drone_id * 0.29) % 1.0)
            at = drone.admin.now
            await drone.order(drone.admin, "take")
            held_at = await _held(drone, at, HOLDS)
            await asyncio.sleep(0.6)
            to_mode.append((held_at - at) * 1e3)
            at_agent.append((held_at - (began_at(drone.tap, at) or math.nan)) * 1e3)
            foreign.append(sum(1 for one in drone.tap.sticks if one.at > held_at and one.who == OPERATOR))
            if number % 4 == 3:
                await _home(drone)
            else:
                await _by_hand(drone)
            drone.tap.forget()

    await _each(squadron, report, "ordered_hold", fly)
    report.spread("ordered_hold", "request_to_mode_at_port", to_mode, "ms")
    report.spread("ordered_hold", "agents_first_act_to_mode_at_port", at_agent, "ms")
    report.add("late_frames", "old_holders_frames_after_hold", sum(foreign), "count")
    report.add("late_frames", "holds", len(foreign), "count")
    p50, p95 = percentile(to_mode, 0.5), percentile(to_mode, 0.95)
    report.say(f"  ordered_hold: {len(to_mode)} times, p50 {p50:.0f}, p95 {p95:.0f} ms; {sum(foreign)} late frames")


async def _held(drone: FlownDrone, since: float, modes: frozenset[int]) -> float:
    """Returns when one of the modes was first reported after `since`."""

    def shown() -> list[float]:
        return [seen.at for seen in drone.tap.modes if seen.at >= since and seen.custom_mode in modes]

    await wait_for("the hold's mode", shown, HELD_BY_S)
    return shown()[0]


async def _drift(squadron: Squadron, report: Report, rounds: int) -> None:
    after_two: list[float] = []
    whole: list[float] = []
    stays: list[float] = []

    async def fly(drone: FlownDrone) -> None:
        await _in_the_air(drone)
        tap = drone.tap
        for _ in range(rounds):
            drone.operator.sticks = Sticks(x=1000)
            try:
                await wait_for("8 m/s", lambda: tap.motions[-1].speed_mps > 7.95, 10)
            except TimeoutError:  # a stick was too late, and the drone holds
                await _home(drone)
                continue
            at = drone.admin.now
            await drone.order(drone.admin, "take")
            stays_at = await _held(drone, at, STAYS)
            until = stays_at + DRIFT_FOR_S
            await wait_for("it to stand still", lambda until=until: drone.admin.now > until, DRIFT_FOR_S + 5)  # type: ignore[misc]
            after_two.append(_farthest(drone, stays_at))
            whole.append(_farthest(drone, at))
            stays.append(stays_at - at)
            await _home(drone)
            tap.forget()

    await _each(squadron, report, "drift", fly)
    report.spread("drift", "after_stage_two", after_two, "m")
    report.spread("drift", "from_the_order", whole, "m")
    report.spread("drift", "order_to_stage_two", stays, "s")
    report.say(
        f"  drift: {len(after_two)} times, after stage two p50 {percentile(after_two, 0.5):.1f}, worst "
        f"{max(after_two, default=math.nan):.1f} m; from the order worst {max(whole, default=math.nan):.1f} m"
    )


def _farthest(drone: FlownDrone, since: float) -> float:
    motions = [motion for motion in drone.tap.motions if motion.at >= since]
    first = motions[0]
    return max(math.hypot(one.north_m - first.north_m, one.east_m - first.east_m) for one in motions)


async def _round_trip(squadron: Squadron, report: Report, rounds: int) -> None:
    """The drones use the line one after the other, so that it is slow for one at a time."""
    times: list[float] = []
    drone = squadron.drones[0]
    axes = list(AXES.values())

    async def fly(drone: FlownDrone) -> None:
        async with delayed_line(squadron.tcp_port, squadron.udp_port) as line:
            drone.tower_address = f"http://{HOST}:{squadron.tcp_port}"
            await _in_the_air(drone)
            for number in range(rounds):
                times.append(await _one_slowing(drone, line, axes[number % len(axes)], 0.5 + number * 0.618 % 1.0))
                if number % 3 == 2:
                    await _home(drone)
                drone.tap.forget()
            await drone.leave()

    del squadron.drones[1:]
    await _each(squadron, report, "round_trip", fly)
    drone.tower_address = None
    report.spread("round_trip", "slower_to_hold", times, "s")
    worst = max(times, default=math.nan)
    report.say(f"  round_trip: {len(times)} times, p50 {percentile(times, 0.5):.2f}, worst {worst:.2f} s")


async def _one_slowing(drone: FlownDrone, line: DelayedLine, sticks: Sticks, seconds: float) -> float:
    """Returns the time from the slowing of the line to the hold's mode at the port."""
    drone.operator.sticks = sticks
    await asyncio.sleep(seconds)
    at = drone.operator.now
    line.delay_s = SLOWER_S
    held_at = await _held(drone, at, HOLDS)
    line.delay_s = 0.0
    drone.operator.sticks = Sticks()
    await asyncio.sleep(3.0)
    await set_mode(drone, LOITER)
    return held_at - at
