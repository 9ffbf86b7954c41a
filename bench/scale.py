"""A thousand drones and twenty browsers on one tower: enrolment, a storm of sign-ins, and delivery over time."""

from __future__ import annotations

import argparse
import asyncio
import gc
import os
import tempfile
import time
from pathlib import Path
from typing import Final

import httpx

from bench.lean_browser import LeanBrowser
from bench.load_agents import LoadAgent, Telemetry, fly, kept_alive, sign_in_all
from bench.load_frames import EVENT_KINDS, STATE_KINDS
from bench.load_tower import LoadTower, load_tower
from bench.process_cost import cpu_us, rss_mb, udp_drops
from bench.rows import Report
from bench.scale_watchers import EventsOnly, Everything

DRONES: Final = 1000
BROWSERS: Final = 20
SECONDS: Final = 600.0
FRAMES_PER_S: Final = 10.0
WATCH_HZ: Final = 5.0
ALLOWANCE_MS: Final = 250.0
"""State may exceed the watch period by this age."""

SAMPLE_S: Final = 10.0
SETTLING_S: Final = 120.0
"""The beginning of a long run is excluded from the slope of memory, because buffers and caches fill up."""
ENROLLED_OVER_REST: Final = 100
STORM: Final = 200
"""Agents that sign in at the same moment, as after a restart of the tower; each retries as the real one does."""

KINDS: Final = (*STATE_KINDS[:3], EVENT_KINDS[3], *STATE_KINDS[:3], *STATE_KINDS[3:9])
"""The messages of a drone, in turn: attitude, position and speed more often than the rest; one in thirteen is an
event."""


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--drones`, `--browsers`, `--seconds`."""
    drones = options.drones or (50 if options.quick else DRONES)
    browsers = options.browsers or (3 if options.quick else BROWSERS)
    seconds = options.seconds or (5.0 if options.quick else SECONDS)
    tower_cpus, load_cpus = _split_cpus()
    before_cpus = os.sched_getaffinity(0)
    if load_cpus:
        os.sched_setaffinity(0, load_cpus)
    try:
        await _run(report, f"{drones} drones, {browsers} browsers", tower_cpus, drones, browsers, seconds)
    finally:
        os.sched_setaffinity(0, before_cpus)


async def _run(
    report: Report, case: str, tower_cpus: set[int] | None, drones: int, browsers: int, seconds: float
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        began = time.monotonic()
        async with load_tower(Path(folder), drones=drones, cpus=tower_cpus) as tower:
            report.add(case, "database, drones and start of the tower", time.monotonic() - began, "s")
            report.add(case, "tower's memory at start", rss_mb(tower.process.pid), "MB")
            await _enrol(report, case, tower)
            watchers = [await _watcher(tower, first=not number) for number in range(browsers)]
            cpu_before, began = cpu_us(tower.process.pid), time.monotonic()
            agents = await sign_in_all(tower.url, tower.keys, at_once=STORM, tries=20)
            async with kept_alive(agents):
                report.add(case, "sign-in: all have a link", time.monotonic() - began, "s")
                await _all_online(tower, drones)
                report.add(case, "sign-in: all online", time.monotonic() - began, "s")
                cpu_s = (cpu_us(tower.process.pid) - cpu_before) / 1e6
                report.add(case, "sign-in: tower's processor", cpu_s, "s")
                await _fly(report, case, tower, agents, watchers, seconds)


def _split_cpus() -> tuple[set[int] | None, set[int] | None]:
    """The tower on the first available processor, the load on the rest; None if there is only one."""
    cpus = sorted(os.sched_getaffinity(0))
    return ({cpus[0]}, set(cpus[1:])) if len(cpus) > 1 else (None, None)


async def _enrol(report: Report, case: str, tower: LoadTower) -> None:
    """Measures an admin's wait for each drone added over REST, on a tower that has this many already."""
    headers = {"Cookie": tower.cookie, "Origin": tower.url}
    async with httpx.AsyncClient(base_url=tower.url, headers=headers, trust_env=False, timeout=60) as http:
        took_ms = []
        for number in range(ENROLLED_OVER_REST):
            began = time.monotonic()
            answer = await http.post("/api/v1/drones", json={"name": f"Enrolled {number}"})
            answer.raise_for_status()
            took_ms.append((time.monotonic() - began) * 1e3)
    report.spread(case, "enrolment over REST", took_ms, "ms")


async def _watcher(tower: LoadTower, *, first: bool) -> Everything | EventsOnly:
    """The first reads every frame, the others only what must not be lost: the load must not distort the measurement."""
    watcher = Everything() if first else EventsOnly()
    browser: LeanBrowser = await tower.browser()
    browser.on_binary = watcher.came
    browser.on_text = watcher.reported
    browser.send_text(f'{{"type":"watch","rate_hz":{WATCH_HZ:g}}}')
    return watcher


async def _all_online(tower: LoadTower, drones: int) -> None:
    async with httpx.AsyncClient(base_url=tower.url, headers={"Cookie": tower.cookie}, trust_env=False) as http:
        async with asyncio.timeout(120):
            while True:
                answer = await http.get("/api/v1/drones")
                if sum(drone["online"] for drone in answer.json()) >= drones:
                    return
                await asyncio.sleep(0.2)


async def _fly(
    report: Report,
    case: str,
    tower: LoadTower,
    agents: list[LoadAgent],
    watchers: list[Everything | EventsOnly],
    seconds: float,
) -> None:
    pid = tower.process.pid
    telemetry = Telemetry(frames_per_s=FRAMES_PER_S, kinds=KINDS, burst=2)
    for watcher in watchers:
        watcher.begin()
    memory: list[tuple[float, float]] = []
    began, cpu_before = time.monotonic(), cpu_us(pid)

    async def sample() -> None:
        while True:
            memory.append((time.monotonic() - began, rss_mb(pid)))
            report.say(f"{memory[-1][0]:6.0f} s: {memory[-1][1]:.1f} MB")
            await asyncio.sleep(SAMPLE_S)

    sampling = asyncio.create_task(sample())
    load_cpu = time.process_time()
    # The load's own pauses are not the tower's: they would add to the age of the data sent and received.
    gc.collect()
    gc.disable()
    try:
        late_s = await fly(agents, telemetry, for_s=seconds)
    finally:
        gc.enable()
    took_s = time.monotonic() - began
    tower_share, load_share = (cpu_us(pid) - cpu_before) / 1e6 / took_s, (time.process_time() - load_cpu) / took_s
    sampling.cancel()
    await asyncio.sleep(1.0)
    memory.append((time.monotonic() - began, rss_mb(pid)))
    frames = sum(agent.sent_frames for agent in agents)
    report.add(case, "flown", took_s, "s")
    report.add(case, "frames sent", frames / took_s, "1/s")
    report.add(case, "datagrams that our own kernel did not take", sum(agent.not_sent for agent in agents), "count")
    overrun = udp_drops(agents[0].tower_port)
    report.add(case, "datagrams for which the tower's socket had no room", overrun, "count")
    report.add(case, "the load was late at the worst", late_s * 1e3, "ms")
    report.add(case, "tower's processor", tower_share * 100, "% of one")
    report.add(case, "load's processor", load_share * 100, "% of one")
    _loss(report, case, agents, watchers)
    _age(report, case, watchers)
    _memory(report, case, memory)


def _loss(report: Report, case: str, agents: list[LoadAgent], watchers: list[Everything | EventsOnly]) -> None:
    sent = sum(agent.sent_events for agent in agents)
    report.add(case, "events sent", sent, "frames")
    missing = [sent - watcher.events for watcher in watchers]
    report.add(case, "events lost, of all browsers together", sum(missing), "frames")
    report.add(case, "events out of order", sum(watcher.out_of_order for watcher in watchers), "frames")
    report.add(
        case, "browsers that were told of a loss", sum(watcher.losses_reported > 0 for watcher in watchers), "count"
    )


def _age(report: Report, case: str, watchers: list[Everything | EventsOnly]) -> None:
    for watcher in watchers:
        if isinstance(watcher, Everything):
            ages = watcher.ages_ms()
            report.spread(case, "age of state as it arrives", ages, "ms")
            limit_ms = 1e3 / WATCH_HZ + ALLOWANCE_MS
            report.add(case, f"state older than {limit_ms:g} ms", sum(age > limit_ms for age in ages), "frames")
            report.add(case, "oldest that a drone's picture became", watcher.stalest_ms(), "ms")


def _memory(report: Report, case: str, memory: list[tuple[float, float]]) -> None:
    settled = [(at_s, mb) for at_s, mb in memory if at_s >= min(SETTLING_S, memory[-1][0] / 2)]
    report.add(case, "tower's memory, first settled", settled[0][1], "MB")
    report.add(case, "tower's memory, last", memory[-1][1], "MB")
    report.add(case, "tower's memory, greatest", max(mb for _, mb in memory), "MB")
    report.add(case, "slope of the tower's memory", slope(settled) * 3600, "MB/h")


def slope(points: list[tuple[float, float]]) -> float:
    """Returns the slope of the least-squares line; 0 without two different times."""
    if len({at for at, _ in points}) < 2:
        return 0.0
    mean_at = sum(at for at, _ in points) / len(points)
    mean_of = sum(of for _, of in points) / len(points)
    return sum((at - mean_at) * (of - mean_of) for at, of in points) / sum((at - mean_at) ** 2 for at, _ in points)
