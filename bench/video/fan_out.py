"""One stream to 1, 10 and 50 viewers in another process: missing units, and the cost of the tower and the Node
relay."""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from typing import Any, Final

from bench.peers.jsmpeg import Relay
from bench.process_cost import rss_mb
from bench.rows import Report
from bench.video.same_units import quiet_tower, recorded, relay_fed, tower_fed
from bench.video.settings import CODEC_WORDS, LARGE, SMALL, Setting
from bench.video.trial import OURS, PEER, Bench, Trial, trial
from bench.video.video_rig import Meter
from wire.video import VIEWER_VIDEO_SUBPROTOCOL

VIEWERS: Final = (1, 10, 50)
WARM_UP_S: Final = 3.0
IDLE_S: Final = 4.0
READY_S: Final = 40.0


@dataclass(frozen=True, slots=True)
class Address:
    """The address of a viewer's WebSocket."""

    url: str
    path: str
    cookie: str
    subprotocol: str
    units: bool

    def as_line(self, count: int) -> bytes:
        named = {name: getattr(self, name) for name in ("url", "path", "cookie", "subprotocol", "units")}
        return json.dumps({**named, "count": count}).encode() + b"\n"


class NoViewers(Exception):
    """Not all viewers received something."""


class Viewers:
    """The viewers' process. `came`: what all of them received since the last query."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    async def came(self) -> dict[str, Any]:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(b"\n")
        answer = await asyncio.wait_for(self._process.stdout.readline(), READY_S)
        if not answer:
            raise NoViewers("the viewers' process has died")
        reported: dict[str, Any] = json.loads(answer)
        return reported


@contextlib.asynccontextmanager
async def viewers_of(address: Address, count: int, trial: Trial) -> AsyncIterator[Viewers]:
    """Yields this many viewers, each with a picture on its screen already. Raises NoViewers."""
    with (trial.logs / "viewers.log").open("ab") as log:
        process = await asyncio.create_subprocess_exec(
            *trial.rig.command_at("tower", sys.executable, "-m", "bench.video.viewers"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=log,
            limit=1 << 24,
        )
    assert process.stdin is not None and process.stdout is not None
    try:
        process.stdin.write(address.as_line(count))
        if await asyncio.wait_for(process.stdout.readline(), READY_S) != b"ready\n":
            raise NoViewers((trial.logs / "viewers.log").read_text()[-400:])
        yield Viewers(process)
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        await process.wait()
        process._transport.close()  # type: ignore[attr-defined]


def ours_at(trial: Trial, setting: Setting) -> Address:
    """The tower's address for the operator, on the tower's host."""
    rig = trial.rig
    cookie = "; ".join(f"{name}={value}" for name, value in rig.operator.http.cookies.items())
    asked = f"quality={setting.quality.name.lower()}&codec={CODEC_WORDS[setting.codec]}"
    return Address(rig.address, f"/api/v1/drones/1/video?{asked}", cookie, VIEWER_VIDEO_SUBPROTOCOL, units=True)


async def fan_out(bench: Bench) -> None:
    for setting in (SMALL, LARGE):
        if not bench.has(setting.words):
            continue
        bench.report.say(f"[bold]fan-out, {setting.words}[/bold]")
        async with trial(bench, f"fan-out {setting.words}", setting, browsers=()) as one:
            for _ in range(bench.rounds):
                for system in bench.systems:
                    await _all_counts(one, system, Costs(bench.report, setting.words))
            await _same_units(one)
    bench.report.system = OURS


async def _same_units(one: Trial) -> None:
    """Neither encoder runs: both relays are fed our units, in turn."""
    setting, rig = one.setting, one.rig
    costs = Costs(one.bench.report, f"{setting.words}, same units")
    ours = ours_at(one, setting)
    units = await recorded(ours.url, ours.path, ours.cookie)
    await rig.until_idle()
    async with quiet_tower(one.logs / "quiet") as (tower, agent):
        theirs = replace(ours, url=tower.url, cookie=tower.cookie)
        for _ in range(one.bench.rounds):
            if OURS in one.bench.systems:
                pid = tower.process.pid
                idle_ms = await _idle_ms(pid) / IDLE_S
                async with tower_fed(tower, agent, units):
                    for count in VIEWERS:
                        await _measured(one, theirs, OURS, count, costs, pid, idle_ms)
            if PEER in one.bench.systems:
                async with one.relay() as relay:
                    idle_ms = await _idle_ms(relay.pid) / IDLE_S
                    address = _at_relay(relay)
                    async with relay_fed(relay, units):
                        for count in VIEWERS:
                            await _measured(one, address, PEER, count, costs, relay.pid, idle_ms)


def _at_relay(relay: Relay) -> Address:
    return Address(f"http://{relay.address}:{relay.viewers_port}", "/", "", "", units=False)


@dataclass(frozen=True, slots=True)
class Costs:
    """The rows of a fan-out."""

    report: Report
    words: str

    def announce(
        self, system: str, count: int, came: dict[str, Any], seconds: float, used_ms: float, idle_ms: float, pid: int
    ) -> None:
        """`idle_ms`: what the same process uses in this time without video."""
        self.report.system = system
        case = f"{count} viewers, {self.words}"
        out_mb, each_us = came["bytes"] / 1e6, (used_ms - idle_ms) * 1e3 / sum(came["messages"])
        self.report.add(case, "processor per MB out", used_ms / out_mb, "ms/MB")
        self.report.add(case, "processor per MB out, beyond idle", (used_ms - idle_ms) / out_mb, "ms/MB")
        self.report.add(case, "processor per message, beyond idle", each_us, "us")
        self.report.add(case, "out", out_mb, "MB")
        self.report.add(case, "to each viewer", came["bytes"] * 8 / 1000 / count / seconds, "kbit/s")
        # Skipped units are reported within a second: some may belong to the time before.
        missing = max(came["missing"] - came["skipped"], 0)
        self.report.add(case, "missing", missing, "units" if system == OURS else "packets")
        self.report.add(case, "skipped", came["skipped"], "units")
        self.report.add(case, "memory", rss_mb(pid), "MB")
        if came["ages_ms"]:
            self.report.spread(case, "camera to viewer", came["ages_ms"], "ms")
        said = (
            f"{used_ms / out_mb:.1f} ms/MB; beyond idle {(used_ms - idle_ms) / out_mb:.1f}, {each_us:.1f} us a message"
        )
        said += f"; {missing} missing, {came['skipped']} skipped of {sum(came['messages'])}"
        self.report.say(f"  {system}, {case}: {said}")


async def _all_counts(one: Trial, system: str, costs: Costs) -> None:
    if system == OURS:
        pid = one.rig.tower.pid
        idle_ms = await _idle_ms(pid) / IDLE_S
        for count in VIEWERS:
            await _measured(one, ours_at(one, one.setting), system, count, costs, pid, idle_ms)
        await one.rig.until_idle()
        return
    async with one.relay() as relay:
        idle_ms = await _idle_ms(relay.pid) / IDLE_S
        address = _at_relay(relay)
        async with one.ffmpeg(relay):
            for count in VIEWERS:
                await _measured(one, address, system, count, costs, relay.pid, idle_ms)


async def _idle_ms(pid: int) -> float:
    meter = Meter({"it": [pid]})
    await asyncio.sleep(IDLE_S)
    return meter.used_ms()["it"]


async def _measured(
    one: Trial, address: Address, system: str, count: int, costs: Costs, pid: int, idle_ms_per_s: float
) -> None:
    async with viewers_of(address, count, one) as viewers:
        await asyncio.sleep(WARM_UP_S)
        await viewers.came()
        meter, began = Meter({"it": [pid]}), time.monotonic()
        await asyncio.sleep(one.bench.seconds)
        used_ms, took_s = meter.used_ms()["it"], time.monotonic() - began
        came = await viewers.came()
    costs.announce(system, count, came, took_s, used_ms, idle_ms_per_s * took_s, pid)
