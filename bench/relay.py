"""`python -m bench relay`: our relay beside its peers, in one run: processor per frame, latency, loss, memory.

The process under test has a dedicated processor, the load (this process) the other ones. Systems take turns, round
after round, so that other activity on the machine affects all of them. See docs/bench.md for the meaning of each case.
"""

from __future__ import annotations

import argparse
import asyncio
import shutil
import statistics
import tempfile
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

from bench.load_frames import STATE_KINDS
from bench.peers.mavproxy import CannotInstall, mavproxy_in
from bench.relay_limits import browsers_served, drones_served, most_without_loss
from bench.relay_measure import IDLE_S, Measured, idle_us_per_s, measure
from bench.relay_sticks import stick_latencies_ms
from bench.relay_systems import Pattern, System, in_c, mavproxy, ours, share_processors, to_websocket
from bench.rows import Report
from server.link.core.read_pacer import MAX_REST_S

PACKED: Final = Pattern("bursts of 5", 5)
UNPACKED: Final = Pattern("bursts of 5, a datagram each", 5, packed=False)
ONE_BY_ONE: Final = Pattern("one by one", 1)
DEADLINE_MS: Final = 1e3 * MAX_REST_S
"""Maximum time that a datagram waits in the tower to be read together with others. Latency is reported with and beyond
it."""

FLOOR: Final = "forwarder, uvloop UDP to WebSocket"


@dataclass(frozen=True)
class Plan:
    """The extent of a run."""

    drones: int = 50
    rates: tuple[float, ...] = (500.0, 2500.0)
    rounds: int = 3
    for_s: float = 4.0
    browsers: tuple[int, ...] = (1, 10, 50)
    fleets: tuple[int, ...] = (1, 10, 100, 1000)
    first_limit: float = 1000.0
    limit_steps: int = 24
    sticks_s: float = 20.0
    linked_s: float = 3.0
    """After the drones have linked, and before the idle tower is measured: what a link begins is then over."""
    idle_s: float = IDLE_S
    warm: bool = True


QUICK: Final = Plan(3, (150.0,), 1, 0.5, (2,), (2,), 500.0, 1, 1.0, 0.0, 0.2, warm=False)


@dataclass
class Found:
    """Results of one system in one case, over the rounds."""

    cpu_us: list[float] = field(default_factory=list)
    whole_us: list[float] = field(default_factory=list)
    latencies_ms: list[float] = field(default_factory=list)
    close_ms: list[float] = field(default_factory=list)
    sticks_ms: list[float] = field(default_factory=list)
    lost: int = 0
    rss_mb: float = 0.0

    def add(self, one: Measured) -> None:
        self.cpu_us.append(one.cpu_us_per_frame)
        self.whole_us.append(one.whole_us_per_frame)
        self.latencies_ms += [us / 1e3 for us in one.latencies_us]
        self.close_ms += [us / 1e3 for us in one.close_us]
        self.sticks_ms += [us / 1e3 for us in one.sticks_us]
        self.lost += max(one.sent - one.arrived, 0)
        self.rss_mb = max(self.rss_mb, one.rss_mb)


async def run(report: Report, options: argparse.Namespace) -> None:
    plan = QUICK if options.quick else Plan()
    if options.rounds:
        plan = Plan(rounds=options.rounds)
    if not share_processors():
        report.say("only one processor: load and systems share it, the figures mean little")
    systems, patterns = await _systems(report, options)
    with tempfile.TemporaryDirectory(prefix="bench-relay-") as folder:
        place = Path(folder)
        wanted = options.case or ["side by side", "limit", "browsers", "drones", "sticks"]
        if "side by side" in wanted:
            await _side_by_side(report, plan, systems, patterns, place)
        if "limit" in wanted:
            await most_without_loss(report, systems, plan.drones, place, plan.first_limit, plan.limit_steps)
        if "browsers" in wanted:
            await browsers_served(report, plan.browsers, plan.drones, plan.rates[-1], plan.for_s, place)
        if "drones" in wanted:
            await drones_served(report, plan.fleets, plan.rates[-1], plan.for_s, place)
        if "sticks" in wanted:
            report.system = "ours"
            rate = plan.rates[-1]
            sent, took = await stick_latencies_ms(
                place / "sticks", drones=plan.drones, frames_per_s=rate, for_s=plan.sticks_s
            )
            case = f"sticks, browser to autopilot, under {rate:g} frames/s"
            report.spread(case, "latency", took, "ms")
            report.add(case, "lost", sent - len(took), "count")


async def _systems(
    report: Report, options: argparse.Namespace
) -> tuple[dict[str, System], dict[str, tuple[Pattern, ...]]]:
    systems: dict[str, System] = {
        "ours": ours,
        "ours, one in focus": partial(ours, focus=True),
        "ours, one flown": partial(ours, focus=True, flown=True),
        "ours, watching at 5 Hz": partial(ours, kinds=STATE_KINDS),
        "ours, watching at 20 Hz": partial(ours, kinds=STATE_KINDS, watch_rate_hz=20.0),
        FLOOR: to_websocket,
        "forwarder, websockets.broadcast": partial(to_websocket, library=True),
    }
    patterns: dict[str, tuple[Pattern, ...]] = {"ours": (PACKED, UNPACKED, ONE_BY_ONE)}
    wanted: list[str] | None = options.system
    if shutil.which("gcc"):
        systems["C, recvfrom and sendto"] = in_c
    else:
        report.say("no C compiler: without the physical floor")
    if not options.quick and (wanted is None or any(name.startswith("MAVProxy") for name in wanted)):
        try:
            program = await mavproxy_in(options.peers.resolve())
            systems["MAVProxy, no modules"] = partial(mavproxy, program=program, modules=False)
            systems["MAVProxy, as usual"] = partial(mavproxy, program=program, modules=True)
        except CannotInstall as reason:
            report.say(f"without MAVProxy: {reason}")
    return {name: one for name, one in systems.items() if wanted is None or name in wanted}, patterns


async def _side_by_side(
    report: Report, plan: Plan, systems: dict[str, System], patterns: dict[str, tuple[Pattern, ...]], place: Path
) -> None:
    found: dict[tuple[str, str], Found] = {}
    for number in range(plan.rounds):
        for index, (name, system) in enumerate(systems.items()):
            folder = place / f"round-{number}-{index}"
            folder.mkdir()
            try:
                async with system(folder, plan.drones) as running:
                    await asyncio.sleep(plan.linked_s)
                    idle = await idle_us_per_s(running, plan.idle_s)
                    for rate in plan.rates:
                        for pattern in patterns.get(name, (PACKED, ONE_BY_ONE)):
                            one = await measure(
                                running,
                                frames_per_s=rate,
                                drones=plan.drones,
                                pattern=pattern,
                                for_s=plan.for_s,
                                idle=idle,
                                warm=plan.warm,
                            )
                            case = f"{plan.drones} drones, {rate:g} frames/s, {pattern.name}"
                            found.setdefault((case, name), Found()).add(one)
                            report.say(
                                f"{number + 1}/{plan.rounds} {name}: {case}: {one.cpu_us_per_frame:.1f} us a frame "
                                f"({one.whole_us_per_frame:.1f} with all), "
                                f"{one.arrived} of {one.sent} in {one.messages}, load late {one.load_late_ms:.1f} ms"
                            )
            except (TimeoutError, RuntimeError, OSError) as reason:
                report.say(f"{name}: given up: {reason}")
    for (case, name), all_rounds in sorted(found.items(), key=lambda item: item[0][0]):
        _add_figures(report, case, name, all_rounds, found)


def _add_figures(report: Report, case: str, name: str, one: Found, found: dict[tuple[str, str], Found]) -> None:
    report.system = name
    cpu_us = statistics.median(one.cpu_us)
    report.add(case, "cpu_per_frame", cpu_us, "us")
    # Our unpacked frames are compared with the forwarder at the same bursts: it has no packing.
    floor = found.get((case.replace(UNPACKED.name, PACKED.name), FLOOR))
    if floor is not None:
        report.add(case, "cpu_of_forwarders", cpu_us / statistics.median(floor.cpu_us), "ratio")
    report.add(case, "cpu_per_frame_whole", statistics.median(one.whole_us), "us")
    if floor is not None:
        report.add(
            case, "whole_of_forwarders", statistics.median(one.whole_us) / statistics.median(floor.whole_us), "ratio"
        )
    report.spread(case, "latency", one.latencies_ms, "ms")
    if one.close_ms:
        report.spread(case, "latency_of_the_focused", one.close_ms, "ms")
    if one.sticks_ms:
        report.spread(case, "latency_of_sticks_down", one.sticks_ms, "ms")
    if name == "ours":
        report.spread(case, "latency_beyond_deadline", [max(ms - DEADLINE_MS, 0.0) for ms in one.latencies_ms], "ms")
    report.add(case, "not_arrived", one.lost, "count")
    report.add(case, "memory", one.rss_mb, "MB")
