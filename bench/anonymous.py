"""`python -m bench anonymous`: what a pilot notices during a combined attack by unauthenticated clients on the tower.

A drone is flown by hand through a tower in its own process. First `--seconds` (60) without an attack, then the same
with all attacks (`bench.attackers`): endless request heads, heads of 1 MB, requests, bodies sent a byte at a time,
1,000 connections, wrong passwords from many networks, 14,000 junk datagrams per second. Tower and agent have the
priority of their systemd units. Meanwhile users sign in with the right password, from an address that the tower knows
and from new ones. See docs/bench.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import tempfile
import time
from pathlib import Path
from typing import Final

from bench.as_installed import run_as_installed
from bench.attackers import KINDS, MORE_KINDS, attacking, post_sign_in
from bench.flown_by_hand import HandFlight, Noticed, figures_of, flown_by_hand
from bench.load_tower import ADMIN, PASSWORD, LoadTower, load_tower
from bench.rows import Report

SECONDS: Final = 60.0
SIGN_IN_EVERY_S: Final = 4.0
ATTACKERS_NICE: Final = 5
"""A lower priority than users and drones, which have their own machines in the field; a higher one than other work on
this machine, so that the attackers reach their rates."""
KNOWN_AT: Final = "127.200.0.1"
PILOT: Final = "pilot"
"""Signs in from new addresses. The attackers do not guess at this name, because those attempts are limited to 100 an
hour."""
_SETTINGS: Final = {"TOWER_ARGON2_MEMORY_KIB": "65536", "TOWER_ARGON2_ROUNDS": "3"}
"""As in production."""


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--seconds`, `--case KIND` (only this attack; may be repeated), `--realtime`."""
    seconds = options.seconds or (4.0 if options.quick else SECONDS)
    kinds = tuple(kind for kind in KINDS | MORE_KINDS if kind in (options.case or KINDS))
    with tempfile.TemporaryDirectory(prefix="bench-anonymous-") as place:
        folder = options.keep or Path(place)
        async with (
            load_tower(folder, drones=1, settings=_SETTINGS, operators=[PILOT]) as tower,
            flown_by_hand(folder, tower) as flight,
        ):
            realtime = bool(options.realtime) and _first_in_line(flight)
            installed = run_as_installed(tower_pid=flight.tower.process.pid, agent_pid=flight.agent_pid)
            report.add("conditions", "tower and agent have the priority of their units", int(installed), "yes=1")
            report.add("conditions", "flight has the processor first", int(realtime), "yes=1")
            await _sign_in(tower, ADMIN, KNOWN_AT)
            await _sign_in(tower, PILOT, KNOWN_AT)
            async with flight.noticing() as quiet:
                await asyncio.sleep(seconds)
            _add_figures(report, "nobody attacks", quiet)
            await _attacked(report, flight, kinds, seconds)


async def _attacked(report: Report, flight: HandFlight, kinds: tuple[str, ...], seconds: float) -> None:
    tower = flight.tower
    case = "all attacks at once" if kinds == tuple(KINDS) else ", ".join(kinds)
    before = await figures_of(tower)
    async with (
        attacking(kinds, tower.url, tower.udp_port, seconds, nice=ATTACKERS_NICE) as attacks,
        flight.noticing() as noticed,
    ):
        took: dict[str, list[float]] = {"known": [], "new": []}
        refused = {"known": 0, "new": 0}
        ends_at, number = time.monotonic() + seconds, 0
        while time.monotonic() + 1.0 < ends_at:
            number += 1
            await asyncio.gather(
                _signs_in(tower, ADMIN, KNOWN_AT, took["known"], refused, "known"),
                _signs_in(tower, PILOT, f"127.201.{number % 250}.1", took["new"], refused, "new"),
                asyncio.sleep(SIGN_IN_EVERY_S),
            )
    _add_figures(report, case, noticed)
    for who in ("known", "new"):
        report.spread(case, f"right sign-in, {who} address", took[who], "s")
        report.add(case, f"right sign-in, {who} address, refused", refused[who], "count")
    for kind, task in attacks.items():
        done = task.result() if task.done() and not task.cancelled() else {}
        for what, count in sorted(done.items()):
            report.add(f"attack: {kind}", what, count, "1/s" if what.endswith("a second") else "count")
    after = await figures_of(tower)
    for name in sorted(after):
        if name.startswith("tower_anonymous_refused_total") and after[name] > before.get(name, 0.0):
            what = name.partition('"')[2].rstrip('"}')
            report.add("refused by the tower", what, after[name] - before.get(name, 0.0), "count")


def _add_figures(report: Report, case: str, noticed: Noticed) -> None:
    report.spread(case, "gap between frames", noticed.gaps_ms, "ms")
    report.spread(case, "stick, browser to autopilot", noticed.sticks_ms, "ms")
    for name, largest, whole in zip(("tower", "agent"), noticed.in_largest_gap(), noticed.in_all(), strict=True):
        report.add(case, f"in the largest gap: {name} ran", largest.ran_ms, "ms")
        report.add(case, f"in the largest gap: {name} waited for a processor", largest.waited_ms, "ms")
        report.add(case, f"in all: {name} ran", whole.ran_ms, "ms")
        report.add(case, f"in all: {name} waited for a processor", whole.waited_ms, "ms")
    report.add(case, "sticks lost", noticed.sticks_lost, "count")
    report.add(case, "this program itself was late by", noticed.own_gap_ms, "ms")
    report.add(case, "holds", noticed.wrong["tower_holds_ordered_total"], "count")
    report.add(case, "steps of holds", noticed.wrong["tower_hold_steps_total"], "count")
    report.add(case, "control channels lost", noticed.wrong["tower_links_orphaned_total"], "count")
    report.add(case, "pilot's channel lost", int(noticed.closed), "yes=1")
    report.add(case, "memory grew by, at most", noticed.rss_most_mb - noticed.rss_before_mb, "MB")
    report.add(case, "memory grew by, afterwards", noticed.rss_after_mb - noticed.rss_before_mb, "MB")
    report.say(f"{case}: largest gap {noticed.largest_gap_ms:.1f} ms, own {noticed.own_gap_ms:.1f} ms")
    report.say("; ".join(f"{gap_ms:.1f} ms at {begun_s:.1f} s" for gap_ms, begun_s in noticed.largest_gaps(6)))


async def _signs_in(
    tower: LoadTower, name: str, address: str, took_s: list[float], refused: dict[str, int], who: str
) -> None:
    began = time.monotonic()
    try:
        await _sign_in(tower, name, address)
    except (OSError, EOFError, TimeoutError):
        refused[who] += 1
    else:
        took_s.append(time.monotonic() - began)


async def _sign_in(tower: LoadTower, name: str, address: str) -> None:
    """Signs in on a new connection, as a browser does on its first visit. Raises OSError if refused."""
    if await post_sign_in(tower.url, name, PASSWORD, address) != 200:
        raise ConnectionRefusedError


def _first_in_line(flight: HandFlight) -> bool:
    """Gives tower, agent and pilot, with all their threads, precedence over everything else on this machine, except the
    password hashing.

    For shared machines: the figures then measure the tower, not the machine. All threads, because a thread that is
    preempted while it holds the interpreter's lock would block the tower.
    """
    with contextlib.suppress(OSError):
        for pid in (flight.tower.process.pid, flight.agent_pid, os.getpid()):
            for thread in Path(f"/proc/{pid}/task").iterdir():
                os.sched_setscheduler(int(thread.name), os.SCHED_RR, os.sched_param(1))
        return True
    return False
