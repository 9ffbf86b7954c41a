"""Sticks through the tower to a drone whose uplink is full of video, compared with no video.

The uplink takes 2 Mbit/s; our three qualities in both codecs at once need 3.4, the peer's ffmpeg is set to 3. Because
our rate control leaves some of the line free, one round adds a bulk transfer to our video that leaves none. The line
emulator counts the actual traffic on the uplink, with all headers.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from typing import Final

from bench.pilot_sticks import STICKS_S
from bench.precise_timer import PreciseTimer
from bench.relay_sticks import StubAutopilot
from bench.rig import free_udp_port
from bench.rows import Report
from bench.video.bulk_up import bulk_up
from bench.video.fan_out import Address, Viewers, ours_at, viewers_of
from bench.video.settings import LARGE, UPLINK, Setting
from bench.video.trial import Bench, Trial, trial
from bench.video.video_rig import VideoRig
from bench.video.way_up import way_up
from wire.dialect import mavlink
from wire.video import Codec, Quality

WARM_UP_S: Final = 5.0
LANDS_S: Final = 1.0
PEERS_BITS_PER_S: Final = 3_000_000
STREAMS: Final = tuple(Setting(quality, codec) for codec in Codec for quality in Quality)
NONE, VIDEO, PEERS = "no video", "our video fills the uplink", "ffmpeg's video fills the uplink"
SHARED = "our video and a bulk upload fill the uplink"
AUDIENCE, SEATS = "one video to 50 viewers", 50


class SticksRig(VideoRig):
    """The simulator is there for its camera; a stub is the autopilot, which reports each stick."""

    autopilot: StubAutopilot

    async def _start_drone(self, tower: str, token: str) -> None:
        with self._at_the_drone():
            agent_port = free_udp_port()
            self.autopilot = StubAutopilot(agent_port)
        await self._start_camera()
        await self._start_agent(tower, token, f"udpin:127.0.0.1:{agent_port}")

    async def stop(self) -> None:
        if hasattr(self, "autopilot"):
            self.autopilot.close()
        await super().stop()


async def sticks(bench: Bench) -> None:
    case = f"sticks, drone with {UPLINK.words}"
    bench.report.say(f"[bold]{case}[/bold]")
    flown: dict[str, Flown] = {}
    number = 0
    async with trial(bench, case, LARGE, {"drone": UPLINK}, browsers=(), kind=SticksRig) as one:
        rig = one.rig
        assert isinstance(rig, SticksRig)
        await rig.operator.control("acquire")
        for _ in range(bench.rounds):
            for what in _whats(bench):
                async with _load(one, what) as viewers:
                    await asyncio.sleep(WARM_UP_S)
                    one_round = flown.setdefault(what, Flown())
                    holds = _holds(rig)
                    number = await _round(one, one_round, viewers, number)
                    one_round.holds += _holds(rig) - holds
    for what, all_rounds in flown.items():
        all_rounds.announce(bench.report, f"{case}, {what}")


@dataclass
class Flown:
    """Under one load, all rounds together."""

    sent: int = 0
    took_ms: list[float] = field(default_factory=list)
    way_up_ms: list[float] = field(default_factory=list)
    way_up_lost: int = 0
    holds: int = 0
    seconds: float = 0.0
    video_bytes: int = 0
    uplink_seconds: float = 0.0
    uplink_bytes: int = 0
    """Of the drone's uplink while sticks flew: whole packets, from IP on."""
    uplink_lost: int = 0
    ages_ms: list[float] = field(default_factory=list)

    def announce(self, report: Report, case: str) -> None:
        report.spread(case, "stick to autopilot", self.took_ms, "ms")
        report.add(case, "sticks that never came", self.sent - len(self.took_ms), "count")
        report.add(case, "holds while they flew", self.holds, "count")
        report.spread(case, "small datagram up the line", self.way_up_ms, "ms")
        report.add(case, "small datagrams lost", self.way_up_lost, "count")
        report.add(case, "video", self.video_bytes * 8 / 1000 / self.seconds, "kbit/s")
        uplink_bps = self.uplink_bytes * 8 / self.uplink_seconds
        report.add(case, "on the uplink, with all headers", uplink_bps / 1000, "kbit/s")
        report.add(case, "share of the uplink", 100 * uplink_bps / UPLINK.up.rate_bps, "%")
        report.add(case, "packets that the uplink's queue had no room for", self.uplink_lost, "count")
        if self.ages_ms:
            report.spread(case, "camera to viewer", self.ages_ms, "ms")


async def _round(one: Trial, flown: Flown, viewers: list[Viewers], number: int) -> int:
    """Adds to `flown`; returns the number of the next stick."""
    rig = one.rig
    assert isinstance(rig, SticksRig) and one.network is not None
    for each in viewers:
        await each.came()
    began = time.monotonic()
    async with way_up(one.network) as probe:
        before, counted_at = await one.network.carried("drone"), time.monotonic()
        landed, sent = await _fly(rig, number, one.bench.seconds)
        carried = await one.network.carried("drone")
        flown.uplink_seconds += time.monotonic() - counted_at
        flown.uplink_bytes += carried.bytes_up - before.bytes_up
        flown.uplink_lost += carried.lost_up - before.lost_up
        await probe.rest()
    for each in viewers:
        came = await each.came()
        flown.video_bytes += came["bytes"]
        flown.ages_ms += came["ages_ms"]
    flown.seconds += time.monotonic() - began
    flown.sent += len(sent)
    flown.took_ms += landed
    flown.way_up_ms += probe.took_ms
    flown.way_up_lost += probe.sent - len(probe.took_ms)
    worst = max(landed, default=float("nan"))
    one.bench.report.say(f"  {len(landed)} of {len(sent)} sticks came, the latest after {worst:.0f} ms")
    return number + len(sent)


def _holds(rig: SticksRig) -> int:
    return sum(event["type"] == "hold" for _, event in rig.operator.events)


def _whats(bench: Bench) -> list[str]:
    return [NONE, *([VIDEO, SHARED, AUDIENCE] if bench.ours else []), *([PEERS] if bench.jsmpeg else [])]


@contextlib.asynccontextmanager
async def _load(one: Trial, what: str) -> AsyncIterator[list[Viewers]]:
    """Yields the viewers' processes, for queries."""
    async with contextlib.AsyncExitStack() as stack:
        if what == SHARED:
            assert one.network is not None
            await stack.enter_async_context(bulk_up(one.network))
        if what in (VIDEO, SHARED):
            yield [await stack.enter_async_context(viewers_of(ours_at(one, each), 1, one)) for each in STREAMS]
        elif what == AUDIENCE:
            yield [await stack.enter_async_context(viewers_of(ours_at(one, LARGE), SEATS, one))]
        elif what == PEERS:
            relay = await stack.enter_async_context(one.relay())
            await stack.enter_async_context(one.ffmpeg(relay, PEERS_BITS_PER_S))
            address = Address(f"http://{relay.address}:{relay.viewers_port}", "/", "", "", units=False)
            yield [await stack.enter_async_context(viewers_of(address, 1, one))]
        else:
            yield []
    if what in (VIDEO, SHARED, AUDIENCE):
        await one.rig.until_idle()


async def _fly(rig: SticksRig, first: int, seconds: float) -> tuple[list[float], list[int]]:
    """Returns (milliseconds of each stick that arrived, the numbers of all that were sent)."""
    timer = PreciseTimer()
    sent: dict[int, float] = {}
    begin = time.monotonic() + 0.2
    try:
        for count in range(round(seconds / STICKS_S)):
            await timer.until(begin + count * STICKS_S)
            number = (first + count) & 0xFFFF
            rig.autopilot.arrived.pop(number, None)
            sent[number] = time.monotonic()
            await rig.operator.send(mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, number))
        await asyncio.sleep(LANDS_S)
    finally:
        timer.close()
    arrived = rig.autopilot.arrived
    return [(arrived[number] - at) * 1e3 for number, at in sent.items() if number in arrived], list(sent)
