"""One environment in which both systems run side by side: a line or loopback, a camera's setting, and the programs."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from playwright.async_api import Browser

from bench.namespaces import Network, emulated_network
from bench.peers.jsmpeg import Jsmpeg, Relay, ffmpeg_to, relay_at
from bench.rows import Report
from bench.video.screens import Shown, chromium, our_page, peers_page
from bench.video.settings import Line, Setting
from bench.video.video_rig import VideoRig, video_running

OURS: Final = "ours"
PEER: Final = "JSMpeg"


@dataclass(frozen=True, slots=True)
class Bench:
    """Of the whole run."""

    report: Report
    folder: Path
    jsmpeg: Jsmpeg | None
    """None: without the peer."""
    ours: bool
    page: Path
    """Our page, built."""
    seconds: float
    """Of each round, without its warm-up."""
    rounds: int
    parts: tuple[str, ...] = ()
    """Runs only cases with one of these in their name; empty: everything."""

    def has(self, case: str) -> bool:
        return not self.parts or any(part in case for part in self.parts)

    @property
    def systems(self) -> list[str]:
        return [*([OURS] if self.ours else []), *([PEER] if self.jsmpeg else [])]


@dataclass
class Trial:
    """Our tower, agent and simulator run all the time; the peer's relay and encoder only in its rounds."""

    bench: Bench
    rig: VideoRig
    network: Network | None
    setting: Setting
    logs: Path
    browsers: dict[str, Browser] = field(default_factory=dict)
    """By their host."""

    @contextlib.asynccontextmanager
    async def relay(self) -> AsyncIterator[Relay]:
        assert self.bench.jsmpeg is not None
        at = self.rig.towers_address
        log = self.logs / "relay.log"
        async with relay_at(self.bench.jsmpeg, at, log, lambda *words: self.rig.command_at("tower", *words)) as relay:
            yield relay

    @contextlib.asynccontextmanager
    async def ffmpeg(self, relay: Relay, bits_per_s: int | None = None) -> AsyncIterator[int]:
        """Runs on the drone's host; yields its pid."""
        one = self.setting
        async with ffmpeg_to(
            relay,
            self.rig.camera,
            one.size,
            one.rate_hz,
            bits_per_s or one.bits_per_s,
            self.logs / "ffmpeg.log",
            lambda *words: self.rig.command_at("drone", *words),
        ) as pid:
            yield pid

    @contextlib.asynccontextmanager
    async def ours_shown(self, host: str = "browser") -> AsyncIterator[Shown]:
        address = self.rig.viewers_address
        async with our_page(self.browsers[host], self.bench.page, address, self.setting) as shown:
            yield shown

    @contextlib.asynccontextmanager
    async def peer_shown(self, relay: Relay, host: str = "browser") -> AsyncIterator[Shown]:
        assert self.bench.jsmpeg is not None
        size = self.setting.width, self.setting.height
        async with peers_page(self.browsers[host], self.bench.jsmpeg, relay.viewers_url, size) as shown:
            yield shown

    @contextlib.asynccontextmanager
    async def shown(self, system: str) -> AsyncIterator[tuple[Shown, dict[str, list[int]]]]:
        """Runs the system alone, with a page that shows it; also yields its processes by name."""
        rig = self.rig
        if system == OURS:
            async with self.ours_shown() as shown:
                pids = {"tower": [rig.tower.pid], "agent, flight": [rig.agent.pid]}
                yield shown, pids | {"agent, video": rig.video_pids()}
            await rig.until_idle()
            return
        async with self.relay() as relay, self.ffmpeg(relay) as pid, self.peer_shown(relay) as shown:
            yield shown, {"relay": [relay.pid], "ffmpeg": [pid]}


@contextlib.asynccontextmanager
async def trial(
    bench: Bench,
    name: str,
    setting: Setting,
    lines: dict[str, Line] | None = None,
    *,
    browsers: tuple[str, ...] = ("browser",),
    kind: type[VideoRig] = VideoRig,
) -> AsyncIterator[Trial]:
    """`lines`: by host; None: loopback, else the emulated network. `browsers`: hosts with one."""
    folder = bench.folder / name.replace("/", " ")
    async with contextlib.AsyncExitStack() as stack:
        network = None
        if lines is not None:
            network = await stack.enter_async_context(emulated_network())
            stack.enter_context(network.inside("tower"))
            for host, line in lines.items():
                await network.change(host, None, **line.ways)
        rig = await stack.enter_async_context(video_running(folder, network, setting, kind))
        one = Trial(bench, rig, network, setting, folder)
        for host in browsers:
            at = lambda *words, host=host: rig.command_at(host, *words)  # noqa: E731
            one.browsers[host] = await stack.enter_async_context(chromium(folder, host, at))
        yield one


def report_used(report: Report, case: str, used_ms: dict[str, float], seconds: float) -> None:
    """Adds rows with the processor of each, in percent of one."""
    for name, ms in used_ms.items():
        report.add(case, f"processor of {name}", ms / seconds / 10, "% of one")
