"""A viewer whose line is throttled to a third of the bit rate for a while, beside one whose line is not."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Final

from bench.link_model import Profile
from bench.rows import Report, percentile
from bench.video.delay import WARM_UP_S
from bench.video.figures import delays_ms, oldest_on_screen_ms, recovered_after_ms, unseen
from bench.video.screens import NothingSeen, Shown
from bench.video.settings import SMALL, Line
from bench.video.strip import Sight
from bench.video.trial import OURS, Bench, Trial, trial

BEFORE_S: Final = 10.0
THROTTLED_S: Final = 20.0
AFTER_S: Final = 15.0
BIN_S: Final = 5.0
USUAL: Final = Profile(delay_s=0.01)
"""Of the viewer's line, each way."""
SHARE: Final = 3
NEAR, FAR = "tower", "browser"
"""The hosts of the unthrottled and of the throttled viewer."""


@dataclass(frozen=True, slots=True)
class Times:
    """Unix ms: measuring begins, the throttle begins, it ends, measuring ends."""

    begin: float
    throttled: float
    freed: float
    end: float


async def throttle(bench: Bench) -> None:
    case = f"{SMALL.words}, a viewer at a third of the bit rate for {THROTTLED_S:g} s"
    bench.report.say(f"[bold]{case}[/bold]")
    lines = {FAR: Line("20 ms round trip", USUAL, USUAL)}
    async with trial(bench, case, SMALL, lines, browsers=(NEAR, FAR)) as one:
        for number in range(bench.rounds):
            for system in bench.systems:
                bench.report.system = system
                where = case if bench.rounds == 1 else f"{case}, round {number + 1}"
                try:
                    async with _two_viewers(one, system) as (throttled, other):
                        await _watched(one, where, throttled, other)
                except NothingSeen as nothing:
                    bench.report.add(where, "failed", 1, "count")
                    bench.report.say(f"  {system}: {nothing}")
    bench.report.system = OURS


@contextlib.asynccontextmanager
async def _two_viewers(one: Trial, system: str) -> AsyncIterator[tuple[Shown, Shown]]:
    if system == OURS:
        async with one.ours_shown(FAR) as throttled, one.ours_shown(NEAR) as other:
            yield throttled, other
        await one.rig.until_idle()
        return
    async with contextlib.AsyncExitStack() as stack:
        relay = await stack.enter_async_context(one.relay())
        await stack.enter_async_context(one.ffmpeg(relay))
        throttled = await stack.enter_async_context(one.peer_shown(relay, FAR))
        yield throttled, await stack.enter_async_context(one.peer_shown(relay, NEAR))


async def _watched(one: Trial, case: str, throttled: Shown, other: Shown) -> None:
    assert one.network is not None
    await asyncio.sleep(WARM_UP_S)
    begin = time.time() * 1000
    await asyncio.sleep(BEFORE_S)
    await one.network.change(FAR, Profile(delay_s=USUAL.delay_s, rate_bps=one.setting.bits_per_s / SHARE))
    began = time.time() * 1000
    await asyncio.sleep(THROTTLED_S)
    await one.network.change(FAR, USUAL)
    freed = time.time() * 1000
    await asyncio.sleep(AFTER_S)
    times = Times(begin, began, freed, time.time() * 1000)
    await throttled.collect()
    await other.collect()
    announce(one.bench.report, case, times, throttled.screen.sights, other.screen.sights, one.setting.rate_hz)


def announce(
    report: Report, case: str, times: Times, throttled: list[Sight], other: list[Sight], rate_hz: float
) -> None:
    """Adds the rows of both viewers."""
    before, during = (_between(throttled, *span) for span in _spans(times))
    usual_ms = percentile(delays_ms(before), 0.95)
    report.add(case, "throttled: delay before, p95", usual_ms, "ms")
    report.spread(case, "throttled: delay meanwhile", delays_ms(during), "ms")
    report.add(case, "throttled: oldest on the screen meanwhile", _oldest(throttled, times), "ms")
    report.add(case, "throttled: pictures a second meanwhile", len(during) / THROTTLED_S, "Hz")
    recovered_ms = recovered_after_ms(throttled, times.freed, usual_ms)
    report.add(case, "throttled: as before after", recovered_ms, "ms")
    quiet_before, quiet_during = (_between(other, *span) for span in _spans(times))
    for name, sights in (("before", quiet_before), ("meanwhile", quiet_during)):
        report.spread(case, f"the other: delay {name}", delays_ms(sights), "ms")
        report.add(case, f"the other: never seen {name}", unseen(sights, rate_hz), "count")
    _over_time(report, case, times, {"throttled": throttled, "the other": other})
    worst_ms = max(delays_ms(during), default=float("nan"))
    report.say(f"  {report.system}: worst {worst_ms:.0f} ms, as before {recovered_ms:.0f} ms after the end")


def _spans(times: Times) -> tuple[tuple[float, float], tuple[float, float]]:
    return (times.begin, times.throttled), (times.throttled, times.freed)


def _between(sights: list[Sight], begin_ms: float, end_ms: float) -> list[Sight]:
    return [one for one in sights if begin_ms <= one.seen_ms < end_ms]


def _oldest(sights: list[Sight], times: Times) -> float:
    """The picture on the screen when the throttle began counts as well."""
    earlier = [one for one in sights if one.seen_ms < times.throttled][-1:]
    during = _between(sights, times.throttled, times.freed)
    after = next((one.seen_ms for one in sights if one.seen_ms >= times.freed), times.end)
    return oldest_on_screen_ms([*earlier, *during], after)


def _over_time(report: Report, case: str, times: Times, viewers: dict[str, list[Sight]]) -> None:
    """Adds a row for each five seconds, counted from the beginning of the throttle."""
    begin = times.throttled - BEFORE_S * 1000
    while begin + BIN_S * 1000 <= times.end + 1:
        since = (begin - times.throttled) / 1000
        for name, sights in viewers.items():
            there = delays_ms(_between(sights, begin, begin + BIN_S * 1000))
            report.add(case, f"{name}: worst delay, {since:+g} to {since + BIN_S:+g} s", max(there, default=0), "ms")
        begin += BIN_S * 1000
