"""The flown table: each way to lose a pilot, in each situation, with each receiver; where is the drone 120 s later?

Several drones fly at once, each its own flight; each starts its next flight when one ends. The tower is killed for all
of its drones together, so those flights run in waves.
"""

from __future__ import annotations

import argparse
import asyncio
import itertools
import math
import re
import signal
from collections.abc import Awaitable, Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import httpx
from websockets.exceptions import InvalidStatus

from bench.control_situations import (
    BESIDE,
    ON_LINE,
    SITUATIONS,
    TRIGGERS,
    Situation,
    TowerEnds,
    Trigger,
    put_mission,
    take_off,
)
from bench.control_timing import CASES, time_holds
from bench.control_verdict import ARDUCOPTER, PX4, Announcement, Record, Verdict, judge
from bench.person import Person, Refused
from bench.px4_situations import PX4_SITUATIONS, fly_px4, set_up_px4
from bench.real_autopilot import NoAutopilot, Receiver
from bench.rig import wait_for
from bench.rows import Report
from bench.squadron import FlownDrone, Squadron, is_px4, squadron_of

TRIES: Final = 3
"""Attempts to reach the situation: on a busy machine the pilot is occasionally lost before that."""
PATIENT: Final = {"rtt_limit_ms": 5000.0, "rtt_limit_s": 10.0, "sticks_stale_s": 2.0}
USUAL: Final = {"sticks_stale_s": 0.5}
WATCHED_S: Final = 120.0
ANNOUNCED_BEFORE_S: Final = 60.0
"""The last report before the trigger is still valid after it."""
DOWN_FOR_S: Final = 5.0
"""A flight ends this long after landing and disarming."""
DRONES: Final = 4
EXPECTED: Final = (Refused, NoAutopilot, TimeoutError, OSError, RuntimeError, httpx.TransportError)
WITHOUT_RECEIVER: Final = {"FS_THR_ENABLE": 1.0, "FS_OPTIONS": 29.0, "RC_OVERRIDE_TIME": 3.0}
WITH_RECEIVER: Final = {"FS_GCS_ENABLE": 1.0, "FS_OPTIONS": 2.0, "RC_OVERRIDE_TIME": 3.0}
"""The console's settings (`--set-up`)."""


@dataclass(frozen=True, slots=True)
class Flight:
    trigger: Trigger
    situation: Situation
    receiver: Receiver
    parameters: tuple[tuple[str, float], ...] = ()
    lost_action: str = "return"
    stick_source: int | None = None
    """COM_RC_IN_MODE of a PX4; None: another autopilot."""

    @property
    def name(self) -> str:
        made = ", set up" if self.parameters else ""
        if self.stick_source is not None:
            made = f", COM_RC_IN_MODE {self.stick_source}"
        then = f", {self.lost_action}" if self.lost_action != "return" else ""
        return f"{self.trigger.name}, {self.situation.name}, {self.receiver}{made}{then}"


def flights_of(names: Sequence[str], count: int, set_up: bool, lost_action: str) -> list[Flight]:
    """Returns the flights with one of `names` in their name (all if empty), in their order, `count` times."""
    made = {one: WITHOUT_RECEIVER if one is Receiver.NONE else WITH_RECEIVER for one in Receiver} if set_up else {}
    table = [
        Flight(trigger, situation, receiver, tuple(made.get(receiver, {}).items()), lost_action)
        for trigger, situation, receiver in itertools.product(
            (*TRIGGERS, *(BESIDE if names else ())), SITUATIONS, Receiver
        )
    ]
    wanted = [name.split("+") for name in names] or [[""]]
    matching = (one for parts in wanted for one in table if all(part in one.name for part in parts))
    chosen = dict.fromkeys(matching)
    return [one for one in chosen for _ in range(count)]


def px4_flights_of(names: Sequence[str], count: int, lost_action: str) -> list[Flight]:
    """The same for PX4, with each source of sticks. A situation flown by hand needs sticks that count."""
    table = [
        Flight(trigger, situation, receiver, (), lost_action, source)
        for trigger, situation, receiver, source in itertools.product(
            (*TRIGGERS, *ON_LINE, *(BESIDE if names else ())), PX4_SITUATIONS, Receiver, (0, 1, 3)
        )
        if not situation.by_hand or source == 1 or (source == 3 and receiver is Receiver.NONE)
    ]
    wanted = [name.split("+") for name in names] or [[""]]
    chosen = dict.fromkeys(one for parts in wanted for one in table if all(part in one.name for part in parts))
    return [one for one in chosen for _ in range(count)]


async def fly_table(report: Report, options: argparse.Namespace, folder: Path) -> None:
    """Runs everything requested. A row for each flight's figures, and the number of failed flights."""
    names = [name.strip() for name in (options.cases or "").split(",") if name.strip()]
    timed = [name for name in names if name in CASES]
    await time_holds(report, options, folder, timed)
    if timed and len(timed) == len(names):
        return
    chosen = [name for name in names if name not in CASES]
    if options.autopilot is not None and is_px4(options.autopilot):
        flights = px4_flights_of(chosen, options.n, options.lost_action)
    else:
        flights = flights_of(chosen, options.n, options.set_up, options.lost_action)
    drones = min(options.drones or DRONES, max(len(flights), 1))
    alone = [one for one in flights if one.trigger.tower is TowerEnds.NOT]
    together = [one for one in flights if one.trigger.tower is not TowerEnds.NOT]
    wrong: list[str] = []
    table = Table(report, wrong)
    if alone:
        async with squadron_of(folder / "table", min(drones, len(alone)), options.autopilot) as squadron:
            await _one_by_one(squadron, alone, table)
    if together:
        async with squadron_of(folder / "tower-killed", min(drones, len(together)), options.autopilot) as squadron:
            await _in_waves(squadron, together, table)
    report.add("flown table", "flights", len(flights), "count")
    report.add("flown table", "went_wrong", len(wrong), "count")
    report.say(f"[bold]{len(flights)} flights, {len(wrong)} went wrong[/bold]")
    for words in wrong:
        report.say(f"  {words}")


class Table:
    """Records the result of each flight."""

    def __init__(self, report: Report, wrong: list[str]) -> None:
        self._report = report
        self._wrong = wrong

    def failed(self, flight: Flight, error: Exception) -> None:
        self._report.say(f"  {flight.name}: could not be flown: {type(error).__name__}: {error}")
        self._report.add(flight.name, "failed", 1, "count")
        self._wrong.append(f"{flight.name}: could not be flown")

    def add(self, flight: Flight, verdict: Verdict, folder: Path) -> None:
        add = self._report.add
        add(flight.name, "wrong", len(verdict.wrong), "count")
        for metric, value, unit in (
            ("held_after", verdict.held_s, "s"),
            ("stays_after", verdict.stays_s, "s"),
            ("drift_after_stage_two", verdict.drift_m, "m"),
            ("announced_after", verdict.announced_s, "s"),
            ("comes_down_after", verdict.returned_s, "s"),
            ("lowest", verdict.lowest_m, "m"),
            ("old_holders_frames_after_hold", verdict.foreign_frames, "count"),
        ):
            if not math.isnan(value):
                add(flight.name, metric, value, unit)
        words = "; ".join(verdict.wrong)
        if words:
            self._wrong.append(f"{flight.name}: {words} ({folder.name})")
        figures = ", ".join(
            f"{name} {value:.2f}{unit}"
            for name, value, unit in (
                ("held", verdict.held_s, " s"),
                ("stays", verdict.stays_s, " s"),
                ("drift", verdict.drift_m, " m"),
                ("reported", verdict.announced_s, " s"),
                ("down", verdict.returned_s, " s"),
            )
            if not math.isnan(value)
        )
        self._report.say(
            f"  {'WRONG' if words else 'ok   '} {flight.name}: {figures}; {verdict.end}{words and ': ' + words}"
        )


async def _one_by_one(squadron: Squadron, flights: Iterable[Flight], table: Table) -> None:
    waiting = list(flights)

    async def fly(drone: FlownDrone) -> None:
        while waiting:
            flight = waiting.pop(0)
            try:
                await _up(drone, flight)
                await flight.situation.reach(drone)
                at = await flight.trigger.pull(drone)
                verdict = await _watch(drone, flight, at)
            except EXPECTED as error:
                table.failed(flight, error)
                continue
            table.add(flight, verdict, drone.folder)
            drone.write_down(flight.name, at)

    await asyncio.gather(*(fly(drone) for drone in squadron.drones))


def _waves(flights: Sequence[Flight], count: int) -> list[list[Flight]]:
    """At most `count` flights in which the same happens to the tower."""
    found: list[list[Flight]] = []
    for _, alike in itertools.groupby(flights, lambda one: one.trigger.tower):
        same = list(alike)
        found += [same[first : first + count] for first in range(0, len(same), count)]
    return found


async def _in_waves(squadron: Squadron, flights: Sequence[Flight], table: Table) -> None:
    for flown in _waves(flights, len(squadron.drones)):
        wave = list(zip(squadron.drones, flown, strict=False))
        flying = await _all(wave, _up, table)
        # A drone that gets there first keeps the situation up until the others follow; those that cannot do so come
        # last.
        lasting = await _all([one for one in flying if not one[1].situation.brief], _reach, table)
        flying = lasting + await _all([one for one in flying if one[1].situation.brief], _reach, table)
        at = squadron.admin.now
        if flown[0].trigger.tower is TowerEnds.SILENT:
            squadron.tower.send_signal(signal.SIGSTOP)
        else:
            squadron.tower.kill()
            await squadron.tower.wait()
        verdicts = await asyncio.gather(*(_watch(drone, flight, at) for drone, flight in flying))
        for (drone, flight), verdict in zip(flying, verdicts, strict=True):
            table.add(flight, verdict, drone.folder)
            drone.write_down(flight.name, at)
        if squadron.tower.returncode is None:
            squadron.tower.kill()
            await squadron.tower.wait()
        await _new_tower(squadron)


async def _new_tower(squadron: Squadron) -> None:
    people = [squadron.admin, *(drone.operator for drone in squadron.drones)]
    for person in people:
        await person.vanish()
    for drone in squadron.drones:
        await drone.kill_agent()
    await squadron.start_tower()
    for person in people:
        await wait_for(f"{person.name} to be live", partial(_is_live, person))


async def _is_live(person: Person) -> bool:
    """A tower that has just started refuses for some seconds while the machine is busy."""
    try:
        await person.go_live()
    except (InvalidStatus, OSError):
        return False
    return True


async def _all(
    wave: Sequence[tuple[FlownDrone, Flight]], work: Callable[[FlownDrone, Flight], Awaitable[None]], table: Table
) -> list[tuple[FlownDrone, Flight]]:
    """Runs all at once; returns those that succeeded."""
    done = await asyncio.gather(*(work(drone, flight) for drone, flight in wave), return_exceptions=True)
    for (_, flight), problem in zip(wave, done, strict=True):
        if isinstance(problem, EXPECTED):
            table.failed(flight, problem)
        elif isinstance(problem, BaseException):
            raise problem
    return [one for one, problem in zip(wave, done, strict=True) if problem is None]


async def _reach(drone: FlownDrone, flight: Flight) -> None:
    await flight.situation.reach(drone)


async def _up(drone: FlownDrone, flight: Flight) -> None:
    """Reaches the height in manual flight. Raises the last problem after TRIES attempts."""
    for left in reversed(range(TRIES)):
        try:
            await _prepare(drone, flight)
            return
        except EXPECTED as error:
            drone.write_down(f"{flight.name}: {error}", drone.operator.now)
            if not left:
                raise


async def _prepare(drone: FlownDrone, flight: Flight) -> None:
    await drone.equip(flight.receiver, dict(flight.parameters))
    if flight.stick_source is not None:
        await set_up_px4(drone, flight.stick_source)
    settings = f"/drones/{drone.drone_id}/settings"
    # The climb and the line are not what is tested here.
    await drone.admin.ask("PATCH", settings, {"lost_action": flight.lost_action, **PATIENT})
    if flight.situation.mission:
        await put_mission(drone)
    if flight.stick_source is not None:
        await fly_px4(drone, flight.situation)
    else:
        await take_off(drone, flight.situation.height_m)
    await drone.admin.ask("PATCH", settings, USUAL)


async def _watch(drone: FlownDrone, flight: Flight, at: float) -> Verdict:
    """Records for 120 s after the trigger, or until landing."""
    trigger, tap = flight.trigger, drone.tap

    def over() -> bool:
        now = drone.admin.now
        down = [seen for seen in tap.modes if seen.at > now - DOWN_FOR_S]
        landed = bool(down) and not any(seen.armed for seen in down) and now > at + 2 * DOWN_FOR_S
        return now > at + WATCHED_S or landed

    await wait_for("the watch to end", over, WATCHED_S + 30)
    people = [("admin", drone.admin)] + ([("operator", drone.operator)] if trigger.operator_stays else [])
    reported = [one for name, person in people for one in _reported(drone, name, person, at - ANNOUNCED_BEFORE_S)]
    return judge(
        Record(
            at=at,
            motions=list(tap.motions),
            modes=list(tap.modes),
            sticks=list(tap.sticks),
            asked=list(tap.mode_requests),
            reported=sorted(reported, key=lambda one: one.at),
            present=frozenset(() if trigger.tower is not TowerEnds.NOT else (name for name, _ in people)),
            old_holder=trigger.old_holder,
            standing=trigger.tower is not TowerEnds.NOT or _is_foretold(drone, trigger),
            has_agent=not trigger.foretold,
            table=ARDUCOPTER if flight.stick_source is None else PX4,
        )
    )


def _is_foretold(drone: FlownDrone, trigger: Trigger) -> bool:
    """Whether the check before flight says that the drone comes down without the computer on board."""
    return trigger.foretold and any(re.search("returns to launch|lands where", one) for one in drone.loss_sentences)


def _reported(drone: FlownDrone, name: str, person: Person, since: float) -> list[Announcement]:
    events = drone.events_since(person, since)
    return [Announcement(at, name, event["drone"].get("hold")) for at, event in events if event["type"] == "drone"]
