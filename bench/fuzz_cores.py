"""Delivers mutated datagrams to a core and judges each: accepted or dropped as expected, or a fault."""

from __future__ import annotations

import asyncio
import gc
import random
import traceback
from collections import Counter
from dataclasses import dataclass, field
from typing import Final, Protocol

from bench.fuzz_datagrams import DatagramFuzzer

_BREATHE_EVERY: Final = 256
"""Datagrams between two turns of the event loop, which run the cores' scheduled callbacks."""

_MAX_REPORTED: Final = 10
WARM_UP_SHARE: Final = 0.2


class Core(Protocol):
    """See fuzz_tower_core and fuzz_agent_core."""

    name: str
    fuzzer: DatagramFuzzer

    def deliver(self, datagram: bytes) -> tuple[set[str], int]:
        """Returns the counted drop reasons, and the number of bytes answered."""

    def rest(self) -> None:
        """Advances time."""

    def counted(self) -> Counter[str]:
        """Returns every drop so far, by reason."""

    def serves(self) -> bool:
        """Returns whether genuine frames still pass."""


@dataclass
class Verdict:
    """The results for a number of datagrams."""

    sent: int = 0
    accepted: int = 0
    dropped: Counter[str] = field(default_factory=Counter)
    """Datagrams by (one of) the reasons counted for them."""
    by_mutation: Counter[str] = field(default_factory=Counter)
    escaped: list[str] = field(default_factory=list)
    """Tracebacks of uncaught exceptions."""
    wrong: list[str] = field(default_factory=list)
    """Unexpected results."""
    objects_grown: int = 0
    """Additional Python objects at the end, compared with after the warm-up."""
    serves: bool = False

    @property
    def faults(self) -> int:
        """0 if everything is as expected."""
        balance = abs(self.sent - self.accepted - self.dropped.total() - len(self.escaped))
        return len(self.escaped) + len(self.wrong) + balance + (not self.serves)


async def fuzz_core(core: Core, datagrams: int) -> Verdict:
    """Delivers the datagrams. Runs in the event loop in which the core was created."""
    verdict = Verdict()
    warm = int(datagrams * WARM_UP_SHARE)
    objects = 0
    for number in range(datagrams):
        if number == warm:
            objects = await _live_objects(core)
        if number % _BREATHE_EVERY == 0:
            await asyncio.sleep(0)
        _one(core, verdict)
    verdict.objects_grown = await _live_objects(core) - objects
    verdict.serves = core.serves()
    return verdict


def _one(core: Core, verdict: Verdict) -> None:
    fuzzed = core.fuzzer.next()
    verdict.sent += 1
    verdict.by_mutation[fuzzed.mutation] += 1
    try:
        reasons, answered = core.deliver(fuzzed.datagram)
    except Exception:
        if len(verdict.escaped) < _MAX_REPORTED:
            verdict.escaped.append(f"{fuzzed.mutation}: {fuzzed.datagram.hex()}\n{traceback.format_exc()}")
        return
    if reasons:
        verdict.dropped[sorted(reasons)[0]] += 1
    else:
        verdict.accepted += 1
    allowed = {None if outcome is None else str(outcome) for outcome in fuzzed.outcomes}
    unfit = reasons - allowed if reasons else {None} - allowed
    if unfit:
        _add_figures(verdict, f"{fuzzed.mutation}: {unfit} is none of {allowed}")
    if answered and not fuzzed.authentic:
        _add_figures(verdict, f"{fuzzed.mutation}: {answered} bytes were answered to somebody unknown")


def _add_figures(verdict: Verdict, words: str) -> None:
    if len(verdict.wrong) < _MAX_REPORTED:
        verdict.wrong.append(words)


async def _live_objects(core: Core) -> int:
    """Returns the number of Python objects once all scheduled work is done."""
    await asyncio.sleep(0.2)
    core.rest()
    gc.collect()
    return len(gc.get_objects())


def chance_of(seed: int, name: str) -> random.Random:
    """Returns the randomness of one part of a run: the same for the same seed, independent of the other parts."""
    return random.Random(f"{seed} {name}")
