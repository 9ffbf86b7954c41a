"""From the camera to the screen: the delay of each picture when it was first seen, both systems in turn."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from bench.rows import Report, percentile
from bench.video.figures import delays_ms, drift_ms_per_minute, oldest_on_screen_ms, unseen
from bench.video.screens import NothingSeen, Shown
from bench.video.settings import Line, Setting
from bench.video.strip import Sight
from bench.video.trial import OURS, PEER, Bench, Trial, report_used, trial
from bench.video.video_rig import Meter

WARM_UP_S: Final = 8.0
COLLECT_S: Final = 2.0


@dataclass
class Seen:
    """Results of one system in one case, all rounds together."""

    rounds: list[list[Sight]] = field(default_factory=list)
    oldest_ms: list[float] = field(default_factory=list)
    unseen: int = 0
    misread: int = 0
    backward: int = 0
    looks: int = 0
    longest_gap_ms: float = 0.0
    reported_ms: list[float] = field(default_factory=list)
    seconds: float = 0.0
    used_ms: Counter[str] = field(default_factory=Counter)

    @property
    def sights(self) -> list[Sight]:
        return [one for sights in self.rounds for one in sights]


async def delays(bench: Bench, case: str, setting: Setting, lines: dict[str, Line] | None = None) -> None:
    """Runs one case: `bench.rounds` rounds of each system in turn."""
    if not bench.has(case):
        return
    bench.report.say(f"[bold]{case}[/bold]")
    seen = {system: Seen() for system in bench.systems}
    failed: Counter[str] = Counter()
    async with trial(bench, case, setting, lines) as one:
        for _ in range(bench.rounds):
            for system in bench.systems:
                try:
                    await _round(one, system, seen[system], bench.seconds)
                except NothingSeen as nothing:
                    failed[system] += 1
                    bench.report.say(f"  {system}: {nothing}")
                else:
                    _say(bench.report, system, seen[system])
    for system, what in seen.items():
        bench.report.system = system
        _add_figures(bench.report, case, what, setting.rate_hz)
        bench.report.add(case, "failed", failed[system], "count")
    bench.report.system = OURS
    if OURS in seen and PEER in seen and seen[OURS].sights and seen[PEER].sights:
        ours, theirs = (percentile(delays_ms(seen[system].sights), 0.95) for system in (OURS, PEER))
        bench.report.add(case, f"p95 below {PEER}'s by", theirs - ours, "ms")


async def _round(one: Trial, system: str, seen: Seen, seconds: float) -> None:
    async with one.shown(system) as (shown, pids):
        await asyncio.sleep(WARM_UP_S)
        if system == OURS:
            pids["agent, video"] = one.rig.video_pids()  # it may have been restarted
        await watch(shown, seen, seconds, one.setting.rate_hz, Meter(pids))


async def watch(shown: Shown, seen: Seen, seconds: float, rate_hz: float, meter: Meter) -> None:
    """Adds to `seen` what is seen from now on."""
    await shown.collect()
    shown.reported_ms.clear()
    looks, misread, backward = shown.looks, shown.screen.misread, shown.screen.backward
    began = time.time()
    while (left := began + seconds - time.time()) > 0:
        await asyncio.sleep(min(COLLECT_S, left))
        await shown.collect()
        seen.longest_gap_ms = max(seen.longest_gap_ms, shown.longest_gap_ms)
    ended = time.time()
    seen.used_ms.update(meter.used_ms())
    sights = shown.screen.between(began * 1000, ended * 1000)
    seen.rounds.append(sights)
    seen.oldest_ms.append(oldest_on_screen_ms(sights, ended * 1000))
    seen.unseen += unseen(sights, rate_hz)
    seen.misread += shown.screen.misread - misread
    seen.backward += shown.screen.backward - backward
    seen.reported_ms += shown.reported_ms
    seen.looks += shown.looks - looks
    seen.seconds += ended - began


def _say(report: Report, system: str, seen: Seen) -> None:
    last = sorted(delays_ms(seen.rounds[-1]))
    if last:
        middle, worst = last[len(last) // 2], last[-1]
        report.say(f"  {system}: {len(last)} pictures, delay p50 {middle:.0f} ms, worst {worst:.0f} ms")
    else:
        report.say(f"  {system}: no pictures")


def _add_figures(report: Report, case: str, seen: Seen, rate_hz: float) -> None:
    if not seen.rounds:
        return
    report.spread(case, "camera to screen", delays_ms(seen.sights), "ms")
    report.add(case, "oldest on the screen", max(seen.oldest_ms), "ms")
    if seen.reported_ms:
        report.spread(case, "delay as the page says it", seen.reported_ms, "ms")
    report.add(case, "pictures a second", len(seen.sights) / seen.seconds, f"Hz, of {rate_hz:g}")
    report.add(case, "pictures never seen", seen.unseen, "count")
    for name, count in (("misread", seen.misread), ("seen after a newer one", seen.backward)):
        if count:
            report.add(case, name, count, "count")
    report.add(case, "looks of the page a second", seen.looks / seen.seconds, "Hz")
    report.add(case, "longest between two looks", seen.longest_gap_ms, "ms")
    report_used(report, case, dict(seen.used_ms), seen.seconds)


async def for_long(bench: Bench, case: str, setting: Setting, minutes: float) -> None:
    """Runs each system for this time, one after the other: does the delay grow?"""
    bench.report.say(f"[bold]{case}[/bold]")
    async with trial(bench, case, setting) as one:
        for system in bench.systems:
            seen = Seen()
            await _round(one, system, seen, minutes * 60)
            _say(bench.report, system, seen)
            bench.report.system = system
            _add_figures(bench.report, case, seen, setting.rate_hz)
            bench.report.add(case, "drift", drift_ms_per_minute(seen.sights), "ms a minute")
    bench.report.system = OURS
