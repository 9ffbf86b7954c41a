"""Sticks through the tower to a drone whose uplink is full of video, beside the same with none.

The uplink takes 2 Mbit/s; our three qualities at once want 2.15, the peer's ffmpeg is told to send 3.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from typing import Final

from bench.precise_timer import PreciseTimer
from bench.relay_sticks import STICKS_S, StubAutopilot
from bench.rig import free_udp_port, wait_for
from bench.video.fan_out import Address, Viewers, ours_at, viewers_of
from bench.video.settings import LARGE, SMALL, UPLINK, Setting
from bench.video.trial import Bench, Trial, trial
from bench.video.video_rig import VideoRig, free_tcp_port
from wire.dialect import mavlink
from wire.video import Quality

WARM_UP_S: Final = 5.0
LANDS_S: Final = 1.0
PEERS_BITS_PER_S: Final = 3_000_000
STREAMS: Final = (LARGE, SMALL, Setting(Quality.LOW))
NONE, VIDEO, PEERS = "no video", "our video fills the uplink", "ffmpeg's video fills the uplink"


class SticksRig(VideoRig):
    """The simulator is there for its camera; a stub is the autopilot, which tells each stick."""

    autopilot: StubAutopilot

    async def _start_drone(self, tower: str, token: str) -> None:
        with self._at_the_drone():
            self._camera_port = free_tcp_port()
            agent_port, nobody = free_udp_port(), free_udp_port()
            self.autopilot = StubAutopilot(agent_port)
        await self._start_simulator(f"udp:127.0.0.1:{nobody}")
        await wait_for("the simulator's camera", self._camera_answers, 60)
        await self._start_agent(tower, token, f"udpin:127.0.0.1:{agent_port}")

    async def stop(self) -> None:
        if hasattr(self, "autopilot"):
            self.autopilot.close()
        await super().stop()


async def sticks(bench: Bench) -> None:
    case = f"sticks, drone with {UPLINK.words}"
    bench.report.say(f"[bold]{case}[/bold]")
    took: dict[str, list[float]] = {}
    sent: dict[str, int] = {}
    number = 0
    async with trial(bench, case, LARGE, {"drone": UPLINK}, browsers=(), kind=SticksRig) as one:
        rig = one.rig
        assert isinstance(rig, SticksRig)
        await rig.operator.control("acquire")
        for _ in range(bench.rounds):
            for what in _whats(bench):
                async with _load(one, what) as told:
                    await asyncio.sleep(WARM_UP_S)
                    carried = await _carried_up(one)
                    began = time.monotonic()
                    landed, flown = await _fly(rig, number, bench.seconds)
                    number += len(flown)
                    took.setdefault(what, []).extend(landed)
                    sent[what] = sent.get(what, 0) + len(flown)
                    packets = (await _carried_up(one) - carried) / (time.monotonic() - began)
                    await _tell_load(one, what, told, packets)
        holds = sum(event["type"] == "hold" for _, event in rig.operator.events)
    report = bench.report
    for what, values in took.items():
        where = f"{case}, {what}"
        report.spread(where, "stick to autopilot", values, "ms")
        report.add(where, "sticks that never came", sent[what] - len(values), "count")
    report.add(case, "holds while they flew", holds, "count")


def _whats(bench: Bench) -> list[str]:
    return [NONE, *([VIDEO] if bench.ours else []), *([PEERS] if bench.jsmpeg else [])]


@contextlib.asynccontextmanager
async def _load(one: Trial, what: str) -> AsyncIterator[list[Viewers]]:
    """Yields what can be asked for what came: the viewers' processes."""
    async with contextlib.AsyncExitStack() as stack:
        if what == VIDEO:
            yield [await stack.enter_async_context(viewers_of(ours_at(one, each), 1, one)) for each in STREAMS]
        elif what == PEERS:
            relay = await stack.enter_async_context(one.relay())
            await stack.enter_async_context(one.ffmpeg(relay, PEERS_BITS_PER_S))
            address = Address(f"http://{relay.address}:{relay.viewers_port}", "/", "", "", units=False)
            yield [await stack.enter_async_context(viewers_of(address, 1, one))]
        else:
            yield []
    if what == VIDEO:
        await one.rig.until_idle()


async def _carried_up(one: Trial) -> int:
    assert one.network is not None
    return (await one.network.carried("drone")).passed_up


async def _tell_load(one: Trial, what: str, viewers: list[Viewers], packets_per_s: float) -> None:
    report, case = one.bench.report, f"sticks, drone with {UPLINK.words}, {what}"
    report.add(case, "packets up a second", packets_per_s, "Hz")
    came = [await each.came() for each in viewers]
    if came:
        seconds = one.bench.seconds + WARM_UP_S
        report.add(case, "video", sum(each["bytes"] for each in came) * 8 / 1000 / seconds, "kbit/s")
        ages = [age for each in came for age in each["ages_ms"]]
        if ages:
            report.spread(case, "camera to viewer", ages, "ms")


async def _fly(rig: SticksRig, first: int, seconds: float) -> tuple[list[float], list[int]]:
    """(milliseconds of each stick that came, the numbers of all that were sent)."""
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
