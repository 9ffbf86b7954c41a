"""When the whole memory is searched for cycles."""

import gc

import pytest

from server.garbage import AT_LEAST_EVERY_S, EVERY_S, YOUNG_OBJECTS, FullSearch, settle_memory


@pytest.fixture
def searches() -> list[float]:
    return []


def test_it_waits_until_nobody_flies_by_hand(searches: list[float]) -> None:
    now = 5.0
    search = FullSearch(now, lambda: searches.append(now))
    for now, by_hand in (
        (5.0 + EVERY_S - 1.0, False),
        (5.0 + EVERY_S, True),
        (5.0 + EVERY_S + 60.0, False),
        (5.0 + EVERY_S + 61.0, False),
    ):
        search.look(now, flown_by_hand=by_hand)
    assert searches == [5.0 + EVERY_S + 60.0]


def test_it_does_not_wait_for_ever(searches: list[float]) -> None:
    now = AT_LEAST_EVERY_S
    FullSearch(0.0, lambda: searches.append(now)).look(now, flown_by_hand=True)
    assert searches == [now]


def test_a_crowd_that_comes_and_goes_is_all_that_is_looked_through() -> None:
    before = gc.get_threshold()
    full: list[str] = []

    def seen(phase: str, about: dict[str, int]) -> None:
        if about["generation"] > 0:
            full.append(phase)

    try:
        settle_memory()
        gc.callbacks.append(seen)
        for _ in range(40):
            assert len([[n] for n in range(YOUNG_OBJECTS + 1)]) > YOUNG_OBJECTS
        assert full == []
    finally:
        gc.callbacks.remove(seen)
        gc.set_threshold(*before)
        gc.unfreeze()
