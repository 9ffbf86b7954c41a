"""`python -m bench tenants`: what a pilot notices of a signed-in operator who tries to disturb everybody.

A drone is flown by hand through a tower with 60 zones of 500 points, in its own process. First `--seconds` (20) without
an attack, then the same with each kind of attack (`bench.tenant_attacks`) alone. The figures are gaps between frames,
the way of a stick, how long a page of the pilot's takes, how long an alert of another drone of theirs, and how long the
tower's event loop stood still. `--case everything`: all kinds at once, for `--minutes` (10) in turns with as long
without, so that what else the machine does burdens both; then each p99 is also a ratio. See docs/bench.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import math
import tempfile
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import httpx

from bench.as_installed import run_as_installed
from bench.flown_by_hand import HandFlight, Noticed, flown_by_hand
from bench.load_agents import kept_alive, sign_in_all
from bench.load_tower import LoadTower, as_somebody, load_tower
from bench.rows import Report, percentile
from bench.tenant_attacks import EVERYTHING, KINDS, attacking_as_tenant
from wire.dialect import build, mavlink

SECONDS: Final = 20.0
PILOT, MALLORY = "pilot", "mallory"
WARNING, OF_MALLORY, FLOWN = 1, 2, 3
"""Drones: one of the pilot's that says of itself that something is wrong, mallory's, and the one that is flown."""
ASK_S: Final = 0.2
WARN_S: Final = 15.0
"""As often as the text of one autopilot becomes an alert."""
WARM_UP_S: Final = 10.0
MOST_RATIO: Final = 1.5
TURN_S: Final = 40.0
"""Of `everything`: so long with the attack, and so long without."""
ZONES, POINTS = 60, 500
_LAT, _LON = 47.0, 8.0


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--seconds`, `--case KIND` (only this attack; may be repeated), `--minutes` with `--case everything`."""
    whole = EVERYTHING in (options.case or ())
    seconds = options.seconds or (4.0 if options.quick else 60.0 * options.minutes if whole else SECONDS)
    with tempfile.TemporaryDirectory(prefix="bench-tenants-") as place:
        folder = options.keep or Path(place)
        async with load_tower(folder, drones=3, operators=[PILOT, MALLORY]) as tower:
            await give_drones(tower)
            await draw_zones(tower, ZONES)
            pilot, mallory = await as_somebody(tower, PILOT), await as_somebody(tower, MALLORY)
            async with flown_by_hand(folder, tower, pilot=pilot) as flight:
                installed = run_as_installed(tower_pid=flight.tower.process.pid, agent_pid=flight.agent_pid)
                report.add("conditions", "tower and agent have the priority of their units", int(installed), "yes=1")
                if whole:
                    await _in_turns(report, flight, pilot, mallory, seconds)
                    return
                noticed, served = await _left_alone(flight, pilot, seconds)
                _add(report, "nobody attacks", noticed, served, {})
                for kind in [one for one in KINDS if one in (options.case or KINDS)]:
                    period = await _attacked(flight, pilot, mallory, kind, seconds)
                    _add(report, kind, period.noticed, period.served, period.held)
                    for what, count in sorted(period.done.items()):
                        report.add(kind, f"attack: {what}", count, "count")


async def _in_turns(report: Report, flight: HandFlight, pilot: LoadTower, mallory: LoadTower, seconds: float) -> None:
    """Everything at once for so long, and as long without. The first two, short, warm up and do not count."""
    turns = max(1, round(seconds / TURN_S))
    turn_s = seconds / turns
    quiet: list[tuple[Noticed, Served]] = []
    periods: list[Period] = []
    for number in range(turns + 1):
        alone = await _left_alone(flight, pilot, turn_s if number else min(turn_s, WARM_UP_S))
        attacked = await _attacked(flight, pilot, mallory, EVERYTHING, turn_s if number else min(turn_s, WARM_UP_S))
        if number:
            quiet.append(alone)
            periods.append(attacked)
    calm = _together(quiet)
    loud = _together([(one.noticed, one.served) for one in periods])
    held: Counter[str] = Counter()
    done: Counter[str] = Counter()
    for one in periods:
        held.update(one.held)
        done.update(one.done)
    _add(report, "nobody attacks", *calm, {})
    _add(report, EVERYTHING, *loud, dict(held))
    for what, count in sorted(done.items()):
        report.add(EVERYTHING, f"attack: {what}", count, "count")
    report.add(EVERYTHING, "turns of each", turns, "count")
    first, last = periods[0].noticed.rss_after_mb, periods[-1].noticed.rss_after_mb
    report.add(EVERYTHING, "memory from the first turn's end to the last one's", last - first, "MB")
    _compare(report, calm, loud)


async def _left_alone(flight: HandFlight, pilot: LoadTower, seconds: float) -> tuple[Noticed, Served]:
    async with flight.noticing() as noticed, others(pilot) as served:
        await asyncio.sleep(seconds)
    return noticed, served


def _together(parts: list[tuple[Noticed, Served]]) -> tuple[Noticed, Served]:
    """One period of several, with all their figures."""
    noticed, served = Noticed(rss_before_mb=parts[0][0].rss_before_mb, rss_after_mb=parts[-1][0].rss_after_mb), Served()
    wrong: Counter[str] = Counter()
    for one, of_others in parts:
        noticed.gaps_before_ms += one.gaps_ms
        noticed.sticks_ms += one.sticks_ms
        noticed.sticks_lost += one.sticks_lost
        noticed.own_gap_ms = max(noticed.own_gap_ms, one.own_gap_ms)
        noticed.rss_most_mb = max(noticed.rss_most_mb, one.rss_most_mb)
        noticed.closed = noticed.closed or one.closed
        wrong.update(one.wrong)
        served.pages_ms += of_others.pages_ms
        served.alerts_ms += of_others.alerts_ms
        served.refused += of_others.refused
        served.warned += of_others.warned
    noticed.wrong = dict(wrong)
    return noticed, served


def _admin(tower: LoadTower) -> httpx.AsyncClient:
    headers = {"Cookie": tower.cookie, "Origin": tower.url}
    return httpx.AsyncClient(base_url=f"{tower.url}/api/v1", headers=headers, trust_env=False, timeout=30.0)


async def give_drones(tower: LoadTower) -> None:
    """To their owners."""
    async with _admin(tower) as admin:
        ids = {one["name"]: one["id"] for one in (await admin.get("/users")).json()}
        for drone_id, owner in ((WARNING, PILOT), (OF_MALLORY, MALLORY), (FLOWN, PILOT)):
            (await admin.put(f"/drones/{drone_id}/owners/{ids[owner]}")).raise_for_status()


async def draw_zones(tower: LoadTower, count: int) -> None:
    """Zones of the tower as airspaces are: many corners, one over the other."""
    async with _admin(tower) as admin:
        for number in range(count):
            points = [_corner(number, at) for at in range(POINTS)]
            body = {"name": f"Zone {number}", "kind": "height-limit", "ceiling_m": 5000, "points": points}
            answer = await admin.post("/zones", json=body)
            if answer.status_code == httpx.codes.TOO_MANY_REQUESTS:  # all of them are more than one person's share
                await asyncio.sleep(float(answer.headers["Retry-After"]))
                answer = await admin.post("/zones", json=body)
            answer.raise_for_status()


def _corner(number: int, at: int) -> list[float]:
    turn, reach = 2 * math.pi * at / POINTS, 0.05 + 0.0005 * number + 0.002 * (at % 2)
    return [round(_LAT + reach * math.sin(turn), 6), round(_LON + reach * math.cos(turn), 6)]


_numbers: Final = itertools.count()
"""Of warnings: one that is open already would be no news."""


@dataclass
class Served:
    """What another person gets of the tower meanwhile."""

    pages_ms: list[float] = field(default_factory=list)
    alerts_ms: list[float] = field(default_factory=list)
    """From the vehicle's text to the browser."""
    refused: int = 0
    warned: int = 0


@contextlib.asynccontextmanager
async def others(pilot: LoadTower) -> AsyncIterator[Served]:
    """The pilot's page asks for its drone, and another drone of theirs warns, until the block ends."""
    served = Served()
    (agent,) = await sign_in_all(pilot.url, [pilot.keys[WARNING - 1]], airborne=True)
    browser = await pilot.browser()
    warned_at: dict[str, float] = {}

    def came(text: bytes) -> None:
        for words in [one for one in warned_at if one.encode() in text]:
            served.alerts_ms.append(1e3 * (time.monotonic() - warned_at.pop(words)))

    async def ask() -> None:
        headers = {"Cookie": pilot.cookie, "Origin": pilot.url}
        async with httpx.AsyncClient(base_url=pilot.url, headers=headers, trust_env=False, timeout=60.0) as client:
            while True:
                began = time.monotonic()
                try:
                    answer = await client.get(f"/api/v1/drones/{FLOWN}")
                    served.refused += answer.status_code != httpx.codes.OK
                except httpx.HTTPError:
                    served.refused += 1
                served.pages_ms.append(1e3 * (time.monotonic() - began))
                await asyncio.sleep(ASK_S)

    async def warn() -> None:
        while True:
            await asyncio.sleep(WARN_S)
            words = "failsafe " + "".join(chr(97 + int(digit)) for digit in str(next(_numbers)))
            warned_at[words] = time.monotonic()
            served.warned += 1
            text = mavlink.MAVLink_statustext_message(2, words.encode())
            agent.send([build(text, system_id=1, component_id=1, sequence=0)], time.monotonic())

    browser.on_text = came
    async with kept_alive([agent]):
        working = [asyncio.create_task(ask()), asyncio.create_task(warn())]
        try:
            yield served
        finally:
            for task in working:
                task.cancel()
            await asyncio.gather(*working, return_exceptions=True)
            browser.close()


@dataclass
class Period:
    """Under attack. `held`: seconds for which the loop stood still, by the code; `done`: what the attack did."""

    noticed: Noticed
    served: Served
    held: dict[str, float]
    done: Counter[str]


async def _attacked(flight: HandFlight, pilot: LoadTower, mallory: LoadTower, kind: str, seconds: float) -> Period:
    tower = flight.tower
    before = await held_s(tower)
    async with (
        attacking_as_tenant(kind, tower.url, mallory.cookie, tower.keys[OF_MALLORY - 1], seconds) as attack,
        flight.noticing() as noticed,
        others(pilot) as served,
    ):
        await asyncio.sleep(seconds)
    after = await held_s(tower)
    held = {where: after[where] - before.get(where, 0.0) for where in after}
    return Period(noticed, served, held, attack.result())


def _compare(report: Report, quiet: tuple[Noticed, Served], attacked: tuple[Noticed, Served]) -> None:
    """Required: at most MOST_RATIO each."""
    figures: dict[str, Callable[[Noticed, Served], list[float]]] = {
        "stick": lambda noticed, served: noticed.sticks_ms,
        "gap between frames": lambda noticed, served: noticed.gaps_ms,
        "page of the pilot's": lambda noticed, served: served.pages_ms,
        "alert": lambda noticed, served: served.alerts_ms,
    }
    for what, of in figures.items():
        ratio = percentile(of(*attacked), 0.99) / percentile(of(*quiet), 0.99)
        report.add(EVERYTHING, f"{what}: p99 with to p99 without, at most {MOST_RATIO}", ratio, "ratio")


async def held_s(tower: LoadTower) -> dict[str, float]:
    """For how long the tower's event loop stood still, by the code."""
    async with _admin(tower) as admin:
        text = (await admin.get(f"{tower.url}/metrics")).text
    lines = [line for line in text.splitlines() if line.startswith("tower_loop_held_seconds_total{")]
    return {line.split('"')[1]: float(line.rsplit(" ", 1)[1]) for line in lines}


def _add(report: Report, case: str, noticed: Noticed, served: Served, held: dict[str, float]) -> None:
    report.spread(case, "page of the pilot's", served.pages_ms, "ms")
    report.add(case, "pages refused", served.refused, "count")
    report.spread(case, "alert, from the vehicle to the browser", served.alerts_ms, "ms")
    report.add(case, "alerts that did not come", served.warned - len(served.alerts_ms), "count")
    report.spread(case, "gap between frames", noticed.gaps_ms, "ms")
    report.spread(case, "stick, browser to autopilot", noticed.sticks_ms, "ms")
    report.add(case, "sticks lost", noticed.sticks_lost, "count")
    report.add(case, "this program itself was late by", noticed.own_gap_ms, "ms")
    report.add(case, "holds", noticed.wrong["tower_holds_ordered_total"], "count")
    report.add(case, "control channels lost", noticed.wrong["tower_links_orphaned_total"], "count")
    report.add(case, "pilot's channel lost", int(noticed.closed), "yes=1")
    report.add(case, "memory grew by, at most", noticed.rss_most_mb - noticed.rss_before_mb, "MB")
    report.add(case, "memory grew by, in the end", noticed.rss_after_mb - noticed.rss_before_mb, "MB")
    for where, seconds in sorted(held.items()):
        if seconds > 0:
            report.add(case, f"loop stood still: {where}", seconds * 1e3, "ms")
