"""One measurement: a load for a time, and its cost. The idle cost is measured before and subtracted."""

from __future__ import annotations

import asyncio
import gc
import time
from dataclasses import dataclass

from bench.load_agents import paced
from bench.process_cost import cpu_us, rss_mb
from bench.relay_systems import Pattern, Running

IDLE_S = 1.5
WARM_S = 0.7
SETTLE_S = 0.4
"""For frames still in transit when the load ends: a watch period and more."""


@dataclass(frozen=True, slots=True)
class Measured:
    sent: int
    arrived: int
    messages: int
    cpu_us_per_frame: float
    """Beyond its use when idle with the same links."""
    whole_us_per_frame: float
    """Everything that it used meanwhile, including keep-alives and clocks."""
    latencies_us: list[float]
    close_us: list[float]
    """Of the drone that a viewer watches closely."""
    sticks_us: list[float]
    """Of sticks, down to its agent."""
    sending_s: float
    """How long the load took to send it."""
    load_late_ms: float
    """Worst lateness of the load itself."""
    rss_mb: float


async def idle_us_per_s(running: Running, for_s: float = IDLE_S) -> float:
    """Returns the cost when idle."""
    begin_us, began_s = cpu_us(running.pid), time.monotonic()
    await asyncio.sleep(for_s)
    return (cpu_us(running.pid) - begin_us) / (time.monotonic() - began_s)


async def measure(
    running: Running,
    *,
    frames_per_s: float,
    drones: int,
    pattern: Pattern,
    for_s: float,
    idle: float,
    warm: bool = True,
) -> Measured:
    """`frames_per_s`: of all drones together. `idle`: microseconds per second, to be subtracted."""
    rate = frames_per_s / drones
    senders, period_s = running.senders(rate, pattern), pattern.burst / rate
    if warm:
        await paced(senders, period_s, max(WARM_S, period_s))
        await asyncio.sleep(SETTLE_S)
    running.sink.clear()
    gc.collect()
    gc.disable()
    try:
        sent_before, began_us, began_s = running.sent(), cpu_us(running.pid), time.monotonic()
        late_s = await paced(senders, period_s, max(for_s, period_s))
        sending_s = time.monotonic() - began_s
        await asyncio.sleep(SETTLE_S)
        whole_us = cpu_us(running.pid) - began_us
        used_us = whole_us - idle * (time.monotonic() - began_s)
    finally:
        gc.enable()
    sent = running.sent() - sent_before
    return Measured(
        sent=sent,
        arrived=running.sink.frames,
        messages=running.sink.messages,
        cpu_us_per_frame=used_us / sent,
        whole_us_per_frame=whole_us / sent,
        latencies_us=running.sink.latencies_us,
        close_us=running.sink.close_us,
        sticks_us=running.sink.sticks_us,
        sending_s=sending_s,
        load_late_ms=late_s * 1e3,
        rss_mb=rss_mb(running.pid),
    )
