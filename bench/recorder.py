"""What recording flights costs a tower, beside one that records none, and what a kill of the tower costs a flight.

Two towers run at the same time, one with TOWER_RECORD_FLIGHTS and one without. The same load flies through one and then
through the other, round by round. Each drone is armed, so that every one of its frames is recorded.
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import tempfile
from contextlib import AsyncExitStack
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Final

import httpx

from bench.load_agents import LoadAgent, Telemetry, fly, kept_alive, sign_in_all
from bench.load_frames import STATE_KINDS
from bench.load_tower import LoadTower, load_tower
from bench.process_cost import cpu_us, rss_mb
from bench.recorder_kills import run_kills
from bench.rows import Report, percentile
from bench.scale_watchers import Everything

DRONES: Final = 100
FRAMES_PER_S: Final = 50.0
ROUNDS: Final = 6
SECONDS: Final = 10.0
KILLS: Final = 50
BURST: Final = 5
SETTLED_S: Final = 1.0


@dataclass
class _Side:
    """One tower with its load. `shares`: of a processor, of each round; `ages_ms`: of frames of the focused drone."""

    name: str
    tower: LoadTower
    agents: list[LoadAgent]
    watcher: Everything
    shares: list[float] = field(default_factory=list)
    ages_ms: list[float] = field(default_factory=list)
    sent: int = 0


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--drones`, `--seconds` of each round, `--rounds`, `--kills`; `--case cost` or `--case kills` for one only."""
    cases = options.case or ["cost", "kills"]
    if "cost" in cases:
        drones = options.drones or (10 if options.quick else DRONES)
        rounds = options.rounds or (2 if options.quick else ROUNDS)
        await _cost(report, drones, rounds, options.seconds or (2.0 if options.quick else SECONDS))
    if "kills" in cases:
        await run_kills(report, options.kills if options.kills is not None else (3 if options.quick else KILLS))


async def _cost(report: Report, drones: int, rounds: int, seconds: float) -> None:
    case = f"{drones} drones at {FRAMES_PER_S:g} frames/s"
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        sides = [await _side(stack, folder, name, drones) for name in ("yes", "no")]
        telemetry = Telemetry(frames_per_s=FRAMES_PER_S, kinds=STATE_KINDS, burst=BURST)
        for number in range(rounds + 1):
            for side in sides if number % 2 else reversed(sides):
                await _round(side, telemetry, seconds, counts=number > 0)  # the first one warms up
            report.say(f"round {number} of {rounds}: " + ", ".join(f"{one.name} {one.shares[-1:]}" for one in sides))
        await asyncio.sleep(SETTLED_S)
        for side in sides:
            report.system = "recording" if side.name == "yes" else "not recording"
            report.add(case, "tower's processor, median of the rounds", median(side.shares) * 100, "% of one")
            report.spread(case, "age of a frame of the watched drone", side.ages_ms, "ms")
            report.add(case, "tower's memory", rss_mb(side.tower.process.pid), "MB")
        with_, without = sides
        more = [(one - other) * 100 for one, other in zip(with_.shares, without.shares, strict=True)]
        report.system = "recording"
        report.add(case, "processor more than without, median", median(more), "% of one")
        report.add(case, "processor more than without, greatest", max(more), "% of one")
        later = percentile(with_.ages_ms, 0.99) - percentile(without.ages_ms, 0.99)
        report.add(case, "age later than without, of 99 in 100", later, "ms")
        figures = await _figures(with_.tower)
        report.add(case, "frames sent", with_.sent, "count")
        report.add(
            case, "frames that the tower took", figures['tower_frames_total{direction="in",peer="agent"}'], "count"
        )
        report.add(case, "frames in the files", figures['tower_flight_frames_total{end="recorded"}'], "count")
        report.system = "ours"


async def _side(stack: AsyncExitStack, folder: Path, name: str, drones: int) -> _Side:
    settings = {"TOWER_RECORD_FLIGHTS": name}
    tower = await stack.enter_async_context(load_tower(folder / name, drones=drones, settings=settings))
    agents = await sign_in_all(tower.url, tower.keys)
    await stack.enter_async_context(kept_alive(agents))
    for agent in agents:
        await agent.report_state()
    watcher = Everything()
    browser = await tower.browser()
    browser.on_binary, browser.on_text = watcher.came, watcher.reported
    browser.send_text('{"type":"watch","rate_hz":1}')
    browser.send_text(f'{{"type":"focus","drone_id":{agents[0].drone_id}}}')
    return _Side(name, tower, agents, _FocusedOnly(watcher, agents[0].drone_id, browser), [])


class _FocusedOnly(Everything):
    """Ages of the drone that is forwarded at once: the others wait for the watch rate."""

    def __init__(self, replaced: Everything, drone_id: int, browser: object) -> None:
        super().__init__()
        self._drone_id = drone_id.to_bytes(4, "little")
        browser.on_binary = self.came  # type: ignore[attr-defined]

    def came(self, message: bytes) -> None:
        at, end = 0, len(message)
        mine: list[bytes] = []
        while at < end:
            after = at + message[at + 5] + 16
            if message[at : at + 4] == self._drone_id:
                mine.append(message[at:after])
            at = after
        super().came(b"".join(mine))


async def _round(side: _Side, telemetry: Telemetry, seconds: float, *, counts: bool) -> None:
    side.watcher.begin()
    pid = side.tower.process.pid
    before, sent = cpu_us(pid), sum(agent.sent_frames for agent in side.agents)
    gc.collect()
    gc.disable()  # a pause of the load is no delay of the tower
    try:
        await fly(side.agents, telemetry, for_s=seconds)
        await asyncio.sleep(SETTLED_S)  # what the round left to be written belongs to it
    finally:
        gc.enable()
    side.sent += sum(agent.sent_frames for agent in side.agents) - sent
    if counts:
        side.shares.append((cpu_us(pid) - before) / 1e6 / seconds)
        side.ages_ms += side.watcher.ages_ms()


async def _figures(tower: LoadTower) -> dict[str, float]:
    async with httpx.AsyncClient(base_url=tower.url, headers={"Cookie": tower.cookie}, trust_env=False) as http:
        answer = await http.get("/metrics")
    answer.raise_for_status()
    lines = [line.rpartition(" ") for line in answer.text.splitlines() if not line.startswith("#")]
    return {name: float(value) for name, _, value in lines}
