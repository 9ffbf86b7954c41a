"""`python -m bench tenants`: what a pilot notices of a signed-in operator who tries to disturb everybody.

A drone is flown by hand through a tower with 60 zones of 500 points, in its own process. First `--seconds` (20) without
an attack, then the same with each kind of attack (`bench.tenant_attacks`) alone. The figures are gaps between frames,
the way of a stick, and how long the tower's event loop stood still. See docs/bench.md.
"""

from __future__ import annotations

import argparse
import asyncio
import math
import tempfile
from pathlib import Path
from typing import Final

import httpx

from bench.as_installed import run_as_installed
from bench.flown_by_hand import HandFlight, Noticed, flown_by_hand
from bench.load_tower import LoadTower, as_somebody, load_tower
from bench.rows import Report
from bench.tenant_attacks import KINDS, attacking_as_tenant

SECONDS: Final = 20.0
PILOT, MALLORY = "pilot", "mallory"
OF_MALLORY, FLOWN = 2, 3
ZONES, POINTS = 60, 500
_LAT, _LON = 47.0, 8.0


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--seconds`, `--case KIND` (only this attack; may be repeated)."""
    seconds = options.seconds or (4.0 if options.quick else SECONDS)
    with tempfile.TemporaryDirectory(prefix="bench-tenants-") as place:
        folder = options.keep or Path(place)
        async with load_tower(folder, drones=3, operators=[PILOT, MALLORY]) as tower:
            await give_drones(tower)
            await draw_zones(tower, ZONES)
            pilot, mallory = await as_somebody(tower, PILOT), await as_somebody(tower, MALLORY)
            async with flown_by_hand(folder, tower, pilot=pilot) as flight:
                installed = run_as_installed(tower_pid=flight.tower.process.pid, agent_pid=flight.agent_pid)
                report.add("conditions", "tower and agent have the priority of their units", int(installed), "yes=1")
                async with flight.noticing() as quiet:
                    await asyncio.sleep(seconds)
                _add(report, "nobody attacks", quiet, {})
                for kind in [one for one in KINDS if one in (options.case or KINDS)]:
                    await _attacked(report, flight, mallory, kind, seconds)


def _admin(tower: LoadTower) -> httpx.AsyncClient:
    headers = {"Cookie": tower.cookie, "Origin": tower.url}
    return httpx.AsyncClient(base_url=f"{tower.url}/api/v1", headers=headers, trust_env=False, timeout=30.0)


async def give_drones(tower: LoadTower) -> None:
    """To their owners."""
    async with _admin(tower) as admin:
        ids = {one["name"]: one["id"] for one in (await admin.get("/users")).json()}
        for drone_id, owner in ((OF_MALLORY, MALLORY), (FLOWN, PILOT)):
            (await admin.put(f"/drones/{drone_id}/owners/{ids[owner]}")).raise_for_status()


async def draw_zones(tower: LoadTower, count: int) -> None:
    """Zones of the tower as airspaces are: many corners, one over the other."""
    async with _admin(tower) as admin:
        for number in range(count):
            points = [_corner(number, at) for at in range(POINTS)]
            body = {"name": f"Zone {number}", "kind": "height-limit", "ceiling_m": 5000, "points": points}
            (await admin.post("/zones", json=body)).raise_for_status()


def _corner(number: int, at: int) -> list[float]:
    turn, reach = 2 * math.pi * at / POINTS, 0.05 + 0.0005 * number + 0.002 * (at % 2)
    return [round(_LAT + reach * math.sin(turn), 6), round(_LON + reach * math.cos(turn), 6)]


async def _attacked(report: Report, flight: HandFlight, mallory: LoadTower, kind: str, seconds: float) -> None:
    tower = flight.tower
    before = await held_s(tower)
    async with (
        attacking_as_tenant(kind, tower.url, mallory.cookie, tower.keys[OF_MALLORY - 1], seconds) as attack,
        flight.noticing() as noticed,
    ):
        await asyncio.sleep(seconds)
    after = await held_s(tower)
    _add(report, kind, noticed, {where: after[where] - before.get(where, 0.0) for where in after})
    for what, count in sorted(attack.result().items()):
        report.add(kind, f"attack: {what}", count, "count")


async def held_s(tower: LoadTower) -> dict[str, float]:
    """For how long the tower's event loop stood still, by the code."""
    async with _admin(tower) as admin:
        text = (await admin.get(f"{tower.url}/metrics")).text
    lines = [line for line in text.splitlines() if line.startswith("tower_loop_held_seconds_total{")]
    return {line.split('"')[1]: float(line.rsplit(" ", 1)[1]) for line in lines}


def _add(report: Report, case: str, noticed: Noticed, held: dict[str, float]) -> None:
    report.spread(case, "gap between frames", noticed.gaps_ms, "ms")
    report.spread(case, "stick, browser to autopilot", noticed.sticks_ms, "ms")
    report.add(case, "sticks lost", noticed.sticks_lost, "count")
    report.add(case, "this program itself was late by", noticed.own_gap_ms, "ms")
    report.add(case, "holds", noticed.wrong["tower_holds_ordered_total"], "count")
    report.add(case, "control channels lost", noticed.wrong["tower_links_orphaned_total"], "count")
    report.add(case, "pilot's channel lost", int(noticed.closed), "yes=1")
    report.add(case, "memory grew by, at most", noticed.rss_most_mb - noticed.rss_before_mb, "MB")
    for where, seconds in sorted(held.items()):
        if seconds > 0:
            report.add(case, f"loop stood still: {where}", seconds * 1e3, "ms")
