"""The emulated link, with a fake clock."""

from collections import Counter
from itertools import pairwise
from typing import Any

import pytest

from bench.link_model import BUFFER_S, LinkModel, Profile


def through(count: int = 2000, *, every_s: float = 0.01, seed: int = 1, size: int = 100, **profile: Any) -> list[Any]:
    """Sends `count` numbered packets through a link. Returns what arrives: (number, when sent, when due)."""
    model = LinkModel(Profile(**profile), seed)
    out = []
    for number in range(count):
        data = number.to_bytes(4, "big") + bytes(size - 4)
        for due, packet in model.packet(data, number * every_s):
            out.append((int.from_bytes(packet[:4], "big"), number * every_s, due))
    return out


def test_a_perfect_link_changes_nothing() -> None:
    assert through(50) == [(number, number * 0.01, number * 0.01) for number in range(50)]


def test_delay_is_exact() -> None:
    assert all(due - sent == pytest.approx(0.15) for _, sent, due in through(delay_s=0.15))


def test_jitter_stays_in_its_bounds_and_keeps_the_order() -> None:
    arrived = through(delay_s=0.1, jitter_s=0.05)
    waits = [due - sent for _, sent, due in arrived]
    assert min(waits) == pytest.approx(0.1, abs=0.002)
    assert max(waits) <= 0.15
    assert [due for *_, due in arrived] == sorted(due for *_, due in arrived)


@pytest.mark.parametrize("loss", [0.05, 0.3])
def test_as_many_are_lost_as_it_says(loss: float) -> None:
    assert len(through(20_000, loss=loss)) / 20_000 == pytest.approx(1 - loss, abs=0.01)


def test_a_black_out_lets_nothing_through_and_ends() -> None:
    model = LinkModel(Profile(black_out=True), 1)
    assert model.packet(b"x", 1.0) == []
    model.profile = Profile()
    assert model.packet(b"x", 2.0) == [(2.0, b"x")]


def test_repeated_ones_come_twice() -> None:
    counts = Counter(number for number, *_ in through(5000, duplication=0.1))
    assert set(counts.values()) == {1, 2}
    assert sum(count == 2 for count in counts.values()) / 5000 == pytest.approx(0.1, abs=0.02)


def test_reordered_ones_overtake() -> None:
    arrived = sorted(through(1000, delay_s=0.1, reordering=0.05), key=lambda one: one[2])
    numbers = [number for number, *_ in arrived]
    assert numbers != sorted(numbers)
    assert sorted(numbers) == list(range(1000))
    assert through(1000, delay_s=0.1) == sorted(through(1000, delay_s=0.1), key=lambda one: one[2])


def test_a_slow_link_lets_its_rate_through_and_drops_what_would_wait_too_long() -> None:
    arrived = through(1000, every_s=0.001, size=125, rate_bps=100_000)
    gaps = [later[2] - sooner[2] for sooner, later in pairwise(arrived)]
    assert min(gaps) == pytest.approx(0.01)
    assert max(due - sent for _, sent, due in arrived) <= BUFFER_S + 0.011
    assert len(arrived) < 250


def test_the_same_seed_does_the_same_and_another_something_else() -> None:
    options = {"loss": 0.1, "jitter_s": 0.05, "duplication": 0.1}
    assert through(seed=7, **options) == through(seed=7, **options)
    assert through(seed=7, **options) != through(seed=8, **options)
