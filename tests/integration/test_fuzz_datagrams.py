"""The short form of `python -m bench fuzz --datagrams`: mutated datagrams at both ends of the data channel."""

import logging
from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest

from bench.fuzz_agent_core import AgentCore
from bench.fuzz_bytes import Mutator
from bench.fuzz_cores import Core, chance_of, fuzz_core
from bench.fuzz_datagrams import DatagramFuzzer
from bench.fuzz_tower_core import TowerCore

DATAGRAMS = 4000
MAX_OBJECTS_GROWN = 500
"""Covers caches and free lists; a leak of one object a datagram would be eight times as much."""


@pytest.fixture(autouse=True)
def silence() -> Any:
    logging.disable(logging.ERROR)
    yield
    logging.disable(logging.NOTSET)


@pytest.mark.parametrize("make", [TowerCore, AgentCore], ids=["tower", "agent"])
async def test_every_mutated_datagram_is_taken_or_dropped_and_counted(make: Callable[..., Core]) -> None:
    core = make(chance_of(4, make.__name__))
    verdict = await fuzz_core(core, DATAGRAMS)
    assert (verdict.escaped, verdict.wrong) == ([], [])
    assert verdict.sent == verdict.accepted + verdict.dropped.total() == DATAGRAMS
    assert set(verdict.by_mutation) == set(core.fuzzer.mutations)
    assert {"too_short", "too_long", "bad_version", "unknown_link", "not_authentic", "replayed"} <= set(verdict.dropped)
    assert {"bad_content", "foreign_tag", "bad_frame", "not-allowed"} <= set(core.counted())
    assert verdict.serves
    assert verdict.objects_grown < MAX_OBJECTS_GROWN


class BadCore:
    """A tower's core with a defect."""

    name = "bad"

    def __init__(self, defect: str) -> None:
        self._good = TowerCore(chance_of(5, defect))
        self._defect = defect
        self._kept: list[list[bytes]] = []
        self.fuzzer: DatagramFuzzer = self._good.fuzzer

    def deliver(self, datagram: bytes) -> tuple[set[str], int]:
        reasons, answered = self._good.deliver(datagram)
        if self._defect == "leaks":
            self._kept.append([datagram])
        if "not_authentic" in reasons:
            if self._defect == "raises":
                raise IndexError("of a parser")
            if self._defect == "believes":
                return set(), answered
            if self._defect == "answers":
                return reasons, 100
        return reasons, answered

    def rest(self) -> None:
        self._good.rest()

    def counted(self) -> Counter[str]:
        return self._good.counted()

    def serves(self) -> bool:
        return self._defect != "is stuck"


@pytest.mark.parametrize("defect", ["raises", "believes", "answers", "leaks", "is stuck"])
async def test_a_defect_is_found(defect: str) -> None:
    verdict = await fuzz_core(BadCore(defect), 1500)
    found = {
        "raises": bool(verdict.escaped),
        "believes": any("None" in words for words in verdict.wrong),
        "answers": any("answered" in words for words in verdict.wrong),
        "leaks": verdict.objects_grown >= MAX_OBJECTS_GROWN,
        "is stuck": not verdict.serves,
    }
    assert found == {name: name == defect for name in found}
    assert (verdict.faults > 0) == (defect != "leaks")


def test_the_same_seed_makes_the_same_bytes() -> None:
    first, second = (Mutator(chance_of(9, "x")) for _ in range(2))
    assert [first.mutate(b"abcdefgh" * 4) for _ in range(50)] == [second.mutate(b"abcdefgh" * 4) for _ in range(50)]
    assert all(bytes(8) != first.flip_bits(bytes(8)) for _ in range(50))
    assert all(first.differently(b"a") != b"a" for _ in range(50))
