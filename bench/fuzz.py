"""Mutated datagrams and WebSocket messages against the real code: no exception escapes, no growth, all is counted."""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import tempfile
import time
from pathlib import Path
from typing import Final

from bench.fuzz_agent_core import AgentCore
from bench.fuzz_cores import Core, chance_of, fuzz_core
from bench.fuzz_tower import FuzzedTower, fuzzed_tower
from bench.fuzz_tower_core import TowerCore
from bench.process_cost import rss_mb, udp_drops
from bench.rows import Report

DATAGRAMS: Final = 1_000_000
MESSAGES: Final = 100_000
QUICK: Final = 50
"""`--quick` divides the numbers by this."""
THROUGH_SOCKETS: Final = 0.02
"""Share of the datagrams also sent through a real UDP socket."""

MAX_OBJECTS_GROWN: Final = 1000
"""Room for caches and free lists, whether for a thousand datagrams or a million."""
MAX_GROWN_MB: Final = 10.0

KINDS: Final = {"live, bytes": 0.4, "live, text": 0.4, "agent, text": 0.2, "video, bytes": 0.1, "video, text": 0.1}
"""Share of the messages for each channel."""
_WARM_UP: Final = 0.1


class FaultsFound(Exception):
    """A check failed; the rows have the details."""


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--datagrams`, `--messages`, `--seed`. Raises FaultsFound at the end if there were any."""
    divisor = QUICK if options.quick else 1
    datagrams = DATAGRAMS // divisor if options.datagrams is None else options.datagrams
    messages = MESSAGES // divisor if options.messages is None else options.messages
    faults: list[str] = []
    for make in (TowerCore, AgentCore):
        if datagrams:
            faults += await _cores(report, make, datagrams // 2, options.seed)
    with tempfile.TemporaryDirectory() as folder:
        async with fuzzed_tower(Path(folder)) as tower:
            if datagrams:
                faults += await _datagram_socket(report, tower, int(datagrams * THROUGH_SOCKETS), options.seed)
            for kind, share in KINDS.items():
                if messages:
                    faults += await _messages(report, tower, kind, int(messages * share), options.seed)
            faults += await _afterwards(report, tower)
    report.add("all", "faults", len(faults), "count")
    if faults:
        raise FaultsFound("\n".join(faults))


async def _cores(report: Report, make: type[TowerCore] | type[AgentCore], datagrams: int, seed: int) -> list[str]:
    logging.disable(logging.ERROR)
    core: Core = make(chance_of(seed, make.name))
    case = f"datagrams, {core.name}, in process"
    report.say(f"{case}: {datagrams}")
    began = time.monotonic()
    verdict = await fuzz_core(core, datagrams)
    logging.disable(logging.NOTSET)
    report.add(case, "sent", verdict.sent, "count")
    report.add(case, "accepted", verdict.accepted, "count")
    for reason, count in sorted(verdict.dropped.items()):
        report.add(case, f"dropped {reason}", count, "count")
    report.add(case, "exceptions escaped", len(verdict.escaped), "count")
    report.add(case, "with another fate than right", len(verdict.wrong), "count")
    report.add(case, "objects grown after the warm-up", verdict.objects_grown, "count")
    report.add(case, "resident memory at the end", rss_mb(os.getpid()), "MB")
    report.add(case, "took", time.monotonic() - began, "s")
    found = [*verdict.escaped, *verdict.wrong]
    if verdict.faults and not found:
        found.append(f"{case}: the account does not balance, or it serves no more")
    if verdict.objects_grown > MAX_OBJECTS_GROWN:
        found.append(f"{case}: {verdict.objects_grown} objects more than after the warm-up")
    return found


async def _datagram_socket(report: Report, tower: FuzzedTower, datagrams: int, seed: int) -> list[str]:
    case = "datagrams, tower, through a socket"
    report.say(f"{case}: {datagrams}")
    before_mb = tower.rss_mb()
    sent = await tower.send_datagrams(chance_of(seed, case), datagrams)
    report.add(case, "sent", sent, "count")
    report.add(case, "memory grown", tower.rss_mb() - before_mb, "MB")
    return [] if await tower.drone_online(2) else [f"{case}: the drone whose link was mutated is offline"]


async def _messages(report: Report, tower: FuzzedTower, kind: str, messages: int, seed: int) -> list[str]:
    case = f"messages, {kind}"
    report.say(f"{case}: {messages}")
    began = time.monotonic()
    warm = int(messages * _WARM_UP)
    await tower.attack(kind, chance_of(seed, f"{case} warm-up"), warm)
    before_mb = tower.rss_mb()
    tower.witness.delays_ms.clear()
    drops_before = await tower.drops()
    account = await tower.attack(kind, chance_of(seed, case), messages - warm)
    counted = await tower.drops() - drops_before
    report.add(case, "sent", warm + account.messages, "count")
    report.add(case, "connections", account.connections, "count")
    report.add(case, "accepted after the warm-up", account.accepted, "count")
    for reason, count in sorted(account.refused.items()):
        report.add(case, f"refused {reason}", count, "count")
    report.add(case, "with another fate than right", len(account.wrong), "count")
    grown_mb = tower.rss_mb() - before_mb
    report.add(case, "memory grown after the warm-up", grown_mb, "MB")
    report.spread(case, "delay at another browser", tower.witness.delays_ms, "ms")
    report.add(case, "took", time.monotonic() - began, "s")
    for reason, count in sorted(counted.items()):
        report.add(case, f"counted by the tower {reason}", count, "count")
    found = [f"{case}: {words}" for words in account.wrong]
    if counted.total() != account.refused.total():
        found.append(f"{case}: {account.refused.total()} were refused, the tower's metrics count {counted.total()}")
    if grown_mb > MAX_GROWN_MB:
        found.append(f"{case}: the tower has grown by {grown_mb:.1f} MB")
    return found


async def _afterwards(report: Report, tower: FuzzedTower) -> list[str]:
    await tower.witness.stop()
    await asyncio.sleep(1.0)
    case = "the tower afterwards"
    errors = tower.errors_in_log()
    report.add(case, "errors and tracebacks in its log", len(errors), "count")
    report.add(case, "events lost at another browser", tower.witness.lost(), "frames")
    overrun = udp_drops(tower.agents[0].tower_port)
    report.add(case, "datagrams for which its socket had no room", overrun, "count")
    report.add(case, "resident memory", tower.rss_mb(), "MB")
    alive = tower.alive and await tower.drone_online(1) and not tower.witness.lost()
    report.add(case, "serves", alive, "yes=1")
    return errors[:5] + ([] if alive else [f"{case}: it does not serve, or has lost what it must not lose"])
