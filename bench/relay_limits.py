"""The limits: maximum frames per second without loss, many browsers, many drones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from bench.relay_measure import idle_us_per_s, measure
from bench.relay_systems import Pattern, Running, System, ours
from bench.rows import Report

BURST: Final = Pattern("bursts of 5", 5)
STEP: Final = 1.3
LIMIT_S: Final = 1.5
TRIES: Final = 3
"""Before a rate counts as too high: a machine that stalls for a moment loses frames too."""
MIN_RATE_HZ: Final = 50.0
"""Frames per second: below this the machine is stalled, whatever the system."""
LOAD_WAS_LATE: Final = "the load could not make more"
LOAD_KEPT_UP: Final = 0.9
"""Share of the wanted rate: below it the load itself is the limit."""


async def most_without_loss(
    report: Report, systems: dict[str, System], drones: int, place: Path, first: float, steps: int
) -> None:
    """Raises the rate by STEP until frames are lost, or the load reaches its limit (a row `load_was_the_limit`, 1).

    If the first rate is already too high, it is lowered by STEP until it is not: every system gets a figure, or a row
    `failed` with the reason reported.
    """
    for index, (name, system) in enumerate(systems.items()):
        if "watching" in name:
            continue  # conflates, which is not loss
        folder = place / f"limit-{index}"
        folder.mkdir()
        report.system = name
        try:
            async with system(folder, drones) as running:
                await _find_most(report, name, running, drones, first, steps)
        except (TimeoutError, RuntimeError, OSError) as reason:
            report.say(f"{name}: given up: {reason}")
            report.add("most without loss", "failed", 1, "yes=1")


async def _find_most(report: Report, name: str, running: Running, drones: int, first: float, steps: int) -> None:
    best, why, rate, lowered = 0.0, "", first, False
    for _ in range(steps):
        refused = await _why_not(running, rate, drones)
        if not refused:
            best = rate
            report.say(f"{name}: {best:,.0f} frames/s without loss")
            if lowered:
                break
            rate *= STEP
            continue
        why = refused
        report.say(f"{name}: {rate:,.0f} frames/s: {why}")
        rate /= STEP
        if best or rate < MIN_RATE_HZ:
            break
        lowered = True
    report.add("most without loss", "frames_per_s", best, "1/s")
    report.add("most without loss", "load_was_the_limit", int(why == LOAD_WAS_LATE), "yes=1")


async def _why_not(running: Running, rate: float, drones: int) -> str:
    """Returns why this rate is too high; empty if it is not."""
    why = ""
    for _ in range(TRIES):
        one = await measure(
            running, frames_per_s=rate, drones=drones, pattern=BURST, for_s=LIMIT_S, idle=0.0, warm=False
        )
        planned_s = max(LIMIT_S, BURST.burst * drones / rate)
        if one.arrived < one.sent:
            why = f"{one.sent - one.arrived} of {one.sent} lost"
        elif one.sending_s >= planned_s / LOAD_KEPT_UP + 0.05:
            why = LOAD_WAS_LATE
        else:
            return ""
    return why


async def browsers_served(
    report: Report, counts: Sequence[int], drones: int, rate: float, for_s: float, place: Path
) -> None:
    """Adds browsers one by one: every frame goes to each of them."""
    report.system = "ours"
    for count in counts:
        folder = place / f"browsers-{count}"
        async with ours(folder, drones) as running:
            assert running.tower is not None
            more = [await running.tower.browser() for _ in range(count - 1)]
            idle = await idle_us_per_s(running)
            before = sum(browser.bytes for browser in more)
            one = await measure(running, frames_per_s=rate, drones=drones, pattern=BURST, for_s=for_s, idle=idle)
            case = f"{count} browsers, {drones} drones, {rate:g} frames/s, all to each"
            report.add(case, "cpu_per_frame_in", one.cpu_us_per_frame, "us")
            report.add(case, "cpu_per_frame_out", one.cpu_us_per_frame / count, "us")
            report.spread(case, "latency", [us / 1e3 for us in one.latencies_us], "ms")
            report.add(case, "not_arrived", one.sent - one.arrived, "count")
            report.add(case, "megabytes_to_the_others", (sum(b.bytes for b in more) - before) / 1e6, "MB")
            report.add(case, "memory", one.rss_mb, "MB")


async def drones_served(report: Report, fleets: Sequence[int], rate: float, for_s: float, place: Path) -> None:
    """The same number of frames, from few drones or from many."""
    report.system = "ours"
    for drones in fleets:
        async with ours(place / f"drones-{drones}", drones) as running:
            idle = await idle_us_per_s(running)
            one = await measure(running, frames_per_s=rate, drones=drones, pattern=BURST, for_s=for_s, idle=idle)
            case = f"{drones} drones, {rate:g} frames/s of all together"
            report.add(case, "cpu_per_frame", one.cpu_us_per_frame, "us")
            report.add(case, "cpu_idle", idle / 1e4, "%")
            report.spread(case, "latency", [us / 1e3 for us in one.latencies_us], "ms")
            report.add(case, "not_arrived", one.sent - one.arrived, "count")
            report.add(case, "memory", one.rss_mb, "MB")
