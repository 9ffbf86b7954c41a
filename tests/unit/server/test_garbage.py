"""When a full garbage collection runs."""

import gc
import mmap

import pytest

from server.runtime.garbage import (
    AGAIN_S,
    AT_LEAST_BYTES,
    AT_LEAST_EVERY_S,
    EVERY_S,
    GROWN_BYTES,
    FullSearch,
    resident_bytes,
    settle_memory,
    unsearched,
)

CROWD = 50_000


class Bench:
    def __init__(self) -> None:
        self.now = 5.0
        self.held = 100_000_000
        self.searches: list[float] = []
        self.search = FullSearch(self.now, collect=lambda: self.searches.append(self.now), memory=lambda: self.held)

    def look(self, after_s: float, *, flown_by_hand: bool = False) -> list[float]:
        self.now = 5.0 + after_s
        self.search.check(self.now, flown_by_hand=flown_by_hand)
        return [at - 5.0 for at in self.searches]


def test_it_is_done_seldom_and_when_nobody_flies_by_hand() -> None:
    bench = Bench()
    assert bench.look(EVERY_S - 1.0) == []
    assert bench.look(EVERY_S, flown_by_hand=True) == []
    assert bench.look(EVERY_S + 60.0) == [EVERY_S + 60.0]
    assert bench.look(EVERY_S + 61.0) == [EVERY_S + 60.0]


def test_it_does_not_wait_for_ever() -> None:
    assert Bench().look(AT_LEAST_EVERY_S, flown_by_hand=True) == [AT_LEAST_EVERY_S]


def test_memory_that_grows_is_looked_through_sooner() -> None:
    bench = Bench()
    bench.held += GROWN_BYTES
    assert bench.look(AGAIN_S - 1.0) == []
    assert bench.look(AGAIN_S, flown_by_hand=True) == []
    assert bench.look(AGAIN_S + 1.0) == [AGAIN_S + 1.0]
    assert bench.look(3 * AGAIN_S) == [AGAIN_S + 1.0], "what is still there after a search is needed"
    bench.held += AT_LEAST_BYTES
    assert bench.look(4 * AGAIN_S, flown_by_hand=True)[1:] == [4 * AGAIN_S]


def test_what_the_process_holds_is_told() -> None:
    before = resident_bytes()
    # Not from the heap, which may have free space from earlier tests.
    with mmap.mmap(-1, 64_000_000) as kept:
        for page in range(0, len(kept), mmap.PAGESIZE):
            kept[page] = 1
        assert resident_bytes() - before > 50_000_000


def test_a_crowd_that_comes_and_goes_starts_no_full_search() -> None:
    before = gc.get_threshold()
    full: list[str] = []

    def seen(phase: str, about: dict[str, int]) -> None:
        if about["generation"] == 2:
            full.append(phase)

    try:
        settle_memory()
        gc.callbacks.append(seen)
        for _ in range(40):
            assert len([[n] for n in range(CROWD)]) == CROWD
        assert full == []
    finally:
        gc.callbacks.remove(seen)
        gc.set_threshold(*before)
        gc.unfreeze()


def test_imports_are_not_searched_and_what_follows_is() -> None:
    with pytest.raises(ImportError), unsearched():
        assert not gc.isenabled()
        raise ImportError
    assert gc.isenabled()
