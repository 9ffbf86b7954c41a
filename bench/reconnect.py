"""A thousand browsers of different users come back at once: after a kill of the tower, and after a cut beside a flight.

A pilot flies a drone through a real agent all the while, 50 sticks a second, in a process of their own. "restart": the
tower is killed and started again; measured from the kill until each browser is live, and the longest gap in the pilot's
sticks from their return to the end of the storm. "cut": every connection but the pilot's breaks and comes back; the
longest gap in the sticks of the whole storm.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import random
import socket
import tempfile
import time
from collections.abc import AsyncIterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final

from bench.load_agents import Telemetry, allow_files, fly, kept_alive, sign_in_all
from bench.load_frames import STATE_KINDS
from bench.load_tower import LoadTower, load_tower, make_fleet
from bench.pilot_process import PilotProcess, longest_gap, pilot_process
from bench.pilot_sticks import take
from bench.process_cost import cpu_us
from bench.reconnecting_browsers import Reconnecting, Seat, all_live
from bench.rows import Report
from server.accounts.store.sessions import Sessions
from server.accounts.store.users import find_user
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.fleet.store.drones import add_owner
from server.http.authentication import COOKIE
from server.storage.database import open_database

BROWSERS: Final = 1000
DRONES: Final = 200
FRAMES_PER_S: Final = 4.0
BEFORE_S: Final = 2.0
AFTER_S: Final = 2.0
LOOK_EVERY_S: Final = 0.2
GAP: Final = "longest gap in the sticks at the autopilot"
PAUSE: Final = "longest pause of the pilot's own sending"
ALL_LIVE_S: Final = 120.0
AGENTS_AT_ONCE: Final = 50
IDLE: Final = timedelta(minutes=2)
"""Since the last use of each session, so that each is written to at its return: the worst case."""


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--browsers N` of as many users, `--drones N`."""
    browsers = options.browsers or (30 if options.quick else BROWSERS)
    drones = options.drones or (6 if options.quick else DRONES)
    allow_files(browsers + 2 * drones + 256)
    cpus = sorted(os.sched_getaffinity(0))
    before = set(cpus)
    if len(cpus) > 1:
        os.sched_setaffinity(0, set(cpus[1:]))
    try:
        with tempfile.TemporaryDirectory(prefix="bench-reconnect-") as folder:
            await _run(report, Path(folder), browsers, drones, {cpus[0]} if len(cpus) > 1 else None)
    finally:
        os.sched_setaffinity(0, before)


async def _run(report: Report, folder: Path, browsers: int, drones: int, cpus: set[int] | None) -> None:
    names = [f"user-{number}" for number in range(browsers)]
    keys = await make_fleet(folder, drones + 1, names)
    tokens = await _sessions(folder, names, drones)
    settings = {"TOWER_PORT": str(_free_port()), "TOWER_UDP_PORT": str(_free_port())}
    seats = [
        Seat(f"{COOKIE}={token}", f"127.1.{number // 250}.{number % 250 + 1}", _drone_of(number, drones))
        for number, token in enumerate(tokens)
    ]
    async with contextlib.AsyncExitStack() as whole:
        async with load_tower(folder, drones=drones + 1, keys=keys, settings=settings, cpus=cpus) as tower:
            chance = random.Random(1)
            crowd = [Reconnecting(tower.url, seat, random.Random(chance.random())) for seat in seats[1:]]
            pilot = await whole.enter_async_context(pilot_process(folder, tower.url, keys[-1], seats[0]))
            for one in crowd:
                whole.push_async_callback(_cancelled, asyncio.create_task(one.run()))
            async with _flying_fleet(tower):
                await all_live(crowd, ALL_LIVE_S)
                await pilot.live()
                await take(_as(tower, seats[0]), drones + 1, "acquire")
                await pilot.fly()
                await asyncio.sleep(BEFORE_S)
            killed_at = time.monotonic()
            for one in crowd:
                one.attempts = 0
            tower.process.kill()
            await tower.process.wait()
        async with load_tower(folder, drones=drones + 1, keys=keys, settings=settings, cpus=cpus) as tower:
            report.add("restart", "start of the tower", time.monotonic() - killed_at, "s")
            async with _flying_fleet(tower):
                await _storm(report, "restart", tower, crowd, pilot, killed_at, flown=False)
                used_s = cpu_us(tower.process.pid) / 1e6
                report.add("restart", "tower's processor, with its start and all sign-ins", used_s, "s")
                for one in crowd:
                    one.attempts = 0
                cpu_before = cpu_us(tower.process.pid)
                cut_at = time.monotonic()
                for one in crowd:
                    one.cut()
                await asyncio.sleep(0.1)
                await _storm(report, "cut", tower, crowd, pilot, cut_at, flown=True)
                used_ms = (cpu_us(tower.process.pid) - cpu_before) / 1e3
                report.add("cut", "tower's processor, with the flight of all drones", used_ms / 1e3, "s")


async def _storm(
    report: Report,
    case: str,
    tower: LoadTower,
    crowd: list[Reconnecting],
    pilot: PilotProcess,
    began: float,
    *,
    flown: bool,
) -> None:
    live = [*await all_live(crowd, ALL_LIVE_S), await pilot.live()]
    if not flown:
        async with asyncio.timeout(ALL_LIVE_S):
            while pilot.first_after(began) is None:
                await asyncio.sleep(LOOK_EVERY_S)
                await pilot.look()
    await asyncio.sleep(AFTER_S)
    await pilot.look()
    returned = pilot.first_after(began)
    assert returned is not None
    end = max(max(live), returned) + AFTER_S / 2
    came_back = [(at - began) for at in live if at > began]
    report.spread(case, "until a browser is live", came_back, "s")
    report.add(case, "all live after", max(came_back), "s")
    report.add(case, "attempts of all browsers but the pilot's", sum(one.attempts for one in crowd), "count")
    report.add(case, "largest welcome", max(one.welcome_bytes for one in crowd) / 1024, "KiB")
    begin = began if flown else returned
    if not flown:
        report.add(case, "until the pilot's sticks are back at the autopilot", returned - began, "s")
    report.add(case, "storm that the sticks were measured in", end - begin, "s")
    gap_s, gap_at = longest_gap(pilot.arrived.values(), begin, end)
    pause_s, pause_at = longest_gap(pilot.sent.values(), begin, end)
    report.add(case, GAP, gap_s * 1e3, "ms")
    report.add(case, "when that gap began", gap_at - began, "s")
    report.add(case, PAUSE, pause_s * 1e3, "ms")
    report.add(case, "when that pause began", pause_at - began, "s")


@contextlib.asynccontextmanager
async def _flying_fleet(tower: LoadTower) -> AsyncIterator[None]:
    """Every drone but the pilot's has a link and sends telemetry."""
    agents = await sign_in_all(tower.url, tower.keys[:-1], at_once=AGENTS_AT_ONCE, tries=20)
    async with kept_alive(agents):
        flying = asyncio.create_task(fly(agents, Telemetry(FRAMES_PER_S, STATE_KINDS, burst=2), for_s=600.0))
        try:
            yield
        finally:
            await _cancelled(flying)


def _drone_of(number: int, drones: int) -> int:
    """Drone 1 to `drones`, in turn; the first user flies the one with the real agent."""
    return drones + 1 if number == 0 else (number - 1) % drones + 1


async def _sessions(folder: Path, names: list[str], drones: int) -> list[str]:
    """Signs every user in and gives each a drone. Written to the database: a thousand passwords take minutes."""
    database = open_database(f"sqlite+aiosqlite:///{folder / 'tower.sqlite3'}")
    now = datetime.now(UTC)
    sessions = Sessions(database, idle_s=3600, lifetime_s=86_400)
    action = AuditAction(by=COMMAND_LINE, at=now)
    tokens = []
    try:
        async with database.writing() as session:
            for number, name in enumerate(names):
                user = await find_user(session, name)
                assert user is not None
                await add_owner(session, drone_id=_drone_of(number, drones), user_id=user.id, action=action)
                begun = await sessions.begin(session, user_id=user.id, now=now - IDLE, address="", user_agent="bench")
                tokens.append(begun.token)
    finally:
        await database.close()
    return tokens


def _free_port() -> int:
    """The tower must come back at the same place."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


def _as(tower: LoadTower, seat: Seat) -> LoadTower:
    return LoadTower(tower.url, tower.process, tower.keys, seat.cookie)


async def _cancelled(task: asyncio.Task[Any]) -> None:
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
