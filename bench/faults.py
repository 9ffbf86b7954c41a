"""Faults of several towers with real processes, under a drone that is flown by hand: killed, frozen, full, locked.

Each case is repeated. At the autopilot's port a tap sees whose sticks arrive: never two people's, whatever fails. Every
change of control and every mission that was acknowledged must be in the database afterwards.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

from bench.fault_cases import CASES, Case
from bench.fault_rig import GONE, FaultRig, Flyer, fault_rig
from bench.fault_services import FaultyPostgres
from bench.fault_truth import Truth, Writer
from bench.hand_flight import HandFlight
from bench.person import Refused
from bench.rig import wait_for
from bench.rows import Report
from bench.tap import ADMIN, OPERATOR

REPEATS: Final = 10
TESTS: Final = Path(__file__).resolve().parents[1] / "tests"
HOLD_MODES: Final = (2, 17)
"""ALT_HOLD and BRAKE."""
STEADY_S: Final = 0.6
AGAIN_S: Final = 0.1
OUTCOME_UNKNOWN: Final = "check what became of the request"
"""The tower's words if the drone's own tower did not answer."""
BACK_WITHIN_S: Final = 60.0
QUICK: Final = ("the drone's tower killed",)


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--repeats N` (10), `--case WORDS` for cases with these in their name, `--quick` for one case once."""
    sys.path.append(str(TESTS))
    from worlds.free_ports import free_tcp_port  # type: ignore[import-not-found]
    from worlds.nats import nats_program, temporary_nats  # type: ignore[import-not-found]
    from worlds.postgres import postgres_programs  # type: ignore[import-not-found]

    programs, nats = postgres_programs(), nats_program()
    if programs is None or nats is None:
        report.say("PostgreSQL or NATS is missing (Debian: apt-get install postgresql nats-server)")
        return
    repeats = options.repeats or (1 if options.quick else REPEATS)
    wanted = options.case or (QUICK if options.quick else [""])
    cases = [case for case in CASES if any(words in case.name for words in wanted)]
    with tempfile.TemporaryDirectory(prefix="bench-faults-") as name:
        folder = Path(options.keep or name)
        Path(name).chmod(0o755)  # PostgreSQL runs as another user  # noqa: ASYNC240
        postgres = FaultyPostgres(programs, Path(name) / "postgres", free_tcp_port())
        try:
            await postgres.make(small_disk=any(case.needs_small_disk for case in cases))
            with temporary_nats(nats) as bus:
                ports = (free_tcp_port(), free_tcp_port())
                async with fault_rig(folder / "towers", postgres, bus, ports) as rig:
                    await HandFlight(rig).take_off()
                    for case in cases:
                        await _measure(report, rig, case, repeats)
        finally:
            postgres.close()


async def _measure(report: Report, rig: FaultRig, case: Case, repeats: int) -> None:
    if case.needs_small_disk and not rig.postgres.has_small_disk:
        report.say(f"{case.name}: left out, it needs to mount a small disk (root)")
        return
    rounds = []
    for number in range(repeats):
        found = await _Round(rig, case).run()
        rounds.append(found)
        report.say(f"{case.name} {number + 1}/{repeats}: {found.in_words()}")
    for metric in ("holds_s", "linked_s", "gap_s", "back_s"):
        values = [getattr(one, metric) for one in rounds if getattr(one, metric) is not None]
        if values:
            report.spread(case.name, _METRICS[metric], values, "s")
    for metric, kind in (("take_s", "TAKE in the fault answered"), ("take_holds_s", "TAKE in the fault to hold")):
        values = [getattr(one, metric) for one in rounds if getattr(one, metric) is not None]
        if values:
            report.spread(case.name, kind, values, "s")
    report.add(case.name, "sticks of two people", sum(one.intruders for one in rounds), "count")
    doubtful = sum(one.doubtful for one in rounds)
    report.add(case.name, "sticks after a change that was done and not answered", doubtful, "count")
    report.add(case.name, "acknowledged", sum(one.acknowledged for one in rounds), "count")
    report.add(case.name, "acknowledged and lost", sum(one.lost for one in rounds), "count")
    report.add(case.name, "rounds", len(rounds), "count")


_METRICS: Final = {
    "holds_s": "fault to hold at the autopilot",
    "linked_s": "fault to link at another tower",
    "gap_s": "longest gap in the pilot's sticks",
    "back_s": "all repaired to TAKE accepted",
}


class Found:
    """What one round has shown. Seconds; None: did not happen."""

    def __init__(self) -> None:
        self.holds_s: float | None = None
        self.linked_s: float | None = None
        self.gap_s: float | None = None
        self.back_s: float | None = None
        self.take_s: float | None = None
        self.take_holds_s: float | None = None
        self.take_outcome = ""
        self.sticks_words = ""
        self.intruders = self.doubtful = self.acknowledged = self.lost = 0

    def in_words(self) -> str:
        shown = {name: value for name, value in vars(self).items() if value not in (None, "")}
        return ", ".join(
            f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}" for name, value in shown.items()
        )


class _Round:
    def __init__(self, rig: FaultRig, case: Case) -> None:
        self._rig = rig
        self._case = case
        self._found = Found()
        self._truth = Truth()

    async def run(self) -> Found:
        rig, case, found = self._rig, self._case, self._found
        home = await rig.home()
        pilot = Flyer(rig, "operator", home if case.pilot_is_near else 1 - home)
        admin = Flyer(rig, "admin", 1 - home)
        await pilot.begin()
        await admin.begin()
        writer = Writer(rig)
        try:
            await self._until_done(pilot, "acquire", OPERATOR)
            rig.operator = pilot.person
            flight = HandFlight(rig)
            await flight.change_mode(flight.modes.by_hand)
            await self._sticks_of(OPERATOR)
            writer.begin()
            await asyncio.sleep(STEADY_S)
            rig.tap.forget()
            links, fault_at = rig.linked_times(), rig.operator.now
            watch = asyncio.create_task(self._watch_links(links, fault_at))
            await case.inject(rig, home)
            if case.takes_after_s is not None:
                await asyncio.sleep(case.takes_after_s)
                await self._take_in_fault(admin)
            await asyncio.sleep(max(0.0, fault_at + case.lasts_s - rig.operator.now))
            await case.heal(rig, home)
            healed_at = rig.operator.now
            await self._until_done(admin, "take", ADMIN)
            found.back_s = rig.operator.now - healed_at
            watch.cancel()
            await self._sticks_of(ADMIN)
            self._read_tap(fault_at)
            await self._until_done(admin, "release", None)
            await self._until_done(pilot, "acquire", OPERATOR)
            await self._sticks_of(OPERATOR)
            await asyncio.sleep(STEADY_S)
            intruders = self._truth.intruders(rig.tap.sticks, fault_at)
            doubtful = self._truth.after_doubt(rig.tap.sticks, fault_at)
            found.intruders, found.doubtful = len(intruders), len(doubtful)
            if intruders or doubtful:
                found.sticks_words = self._truth.in_words(intruders + doubtful, fault_at)
            found.acknowledged, found.lost = await writer.end()
            epoch, holder = await rig.lease()
            found.acknowledged += self._truth.acknowledged
            found.lost += (epoch, holder) != (self._truth.epoch, "operator")
        finally:
            await writer.stop()
            await admin.end()
            await pilot.end()
        return found

    async def _watch_links(self, links: int, fault_at: float) -> None:
        while self._rig.linked_times() <= links:  # noqa: ASYNC110  # the agent's log
            await asyncio.sleep(0.02)
        self._found.linked_s = self._rig.operator.now - fault_at

    async def _take_in_fault(self, admin: Flyer) -> None:
        asked_at = admin.person.now
        try:
            async with asyncio.timeout(10):
                answer = await admin.person.control("take")
            self._truth.changed(ADMIN, asked_at, admin.person.now, answer["epoch"])
            self._found.take_outcome = "done"
        except Refused as refused:
            self._found.take_outcome = f"refused ({str(refused).split(': ')[2][:3]})"
            if OUTCOME_UNKNOWN in str(refused):
                self._truth.in_doubt(ADMIN, asked_at)
        except GONE as error:
            self._found.take_outcome = f"no answer ({type(error).__name__})"
            self._truth.in_doubt(ADMIN, asked_at)
        self._found.take_s = admin.person.now - asked_at
        self._asked_at = asked_at

    async def _until_done(self, flyer: Flyer, verb: str, holder: int | None) -> None:
        """Repeats a change of control until the tower has answered that it is done, or the database has it."""
        deadline = time.monotonic() + BACK_WITHIN_S
        wanted = {OPERATOR: "operator", ADMIN: "admin", None: None}[holder]
        while True:
            asked_at, said = flyer.person.now, ""
            try:
                async with asyncio.timeout(10):
                    answer = await flyer.person.control(verb)
                self._truth.changed(holder, asked_at, flyer.person.now, answer["epoch"])
                return
            except GONE as error:
                said = str(error)
                if "already-yours" in said and self._truth.holder == holder:
                    return  # the TAKE in the fault was done
                if not isinstance(error, Refused) or OUTCOME_UNKNOWN in said:
                    self._truth.in_doubt(holder, asked_at)
            with contextlib.suppress(Exception):  # the database may still be away
                epoch, is_now = await self._rig.lease()
                if is_now == wanted and (verb != "take" or self._truth.epoch != epoch):
                    self._truth.changed(holder, asked_at, flyer.person.now, epoch)
                    return
            if time.monotonic() > deadline:
                raise TimeoutError(f"{self._case.name}: {verb} is not done: {said}")
            await asyncio.sleep(AGAIN_S)

    async def _sticks_of(self, who: int) -> None:
        began_at = self._rig.operator.now
        sticks = self._rig.tap.sticks
        await wait_for(
            f"sticks of {who}", lambda: any(one.who == who and one.at > began_at for one in sticks[-40:]), BACK_WITHIN_S
        )

    def _read_tap(self, fault_at: float) -> None:
        found, tap, taken_at = self._found, self._rig.tap, self._truth.taken_at
        asked_at = getattr(self, "_asked_at", None)
        first = next((one.at for one in tap.modes if one.at > fault_at and one.custom_mode in HOLD_MODES), None)
        if first is not None and first < taken_at:
            found.holds_s = first - fault_at
            if asked_at is not None and first > asked_at:
                found.take_holds_s = first - asked_at
        until = min(taken_at, asked_at or taken_at)
        times = [fault_at, *(one.at for one in tap.sticks if one.who == OPERATOR and fault_at < one.at < until), until]
        found.gap_s = max(later - earlier for earlier, later in itertools.pairwise(times))
