"""Periodic timers wake the process together."""

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest

from server.runtime import aligned_timers
from server.runtime.aligned_timers import BEAT_S, SharedChecks, rest


class Clock:
    """Time passes only in sleeps, which are recorded."""

    def __init__(self, now: float) -> None:
        self.now = now
        self.slept: list[float] = []

    async def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


@pytest.fixture
async def clock_at(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Callable[[float], Clock]]:
    def begin(now: float) -> Clock:
        clock = Clock(now)
        monkeypatch.setattr(aligned_timers.time, "monotonic", lambda: clock.now)
        monkeypatch.setattr(aligned_timers.asyncio, "sleep", clock.sleep)
        return clock

    yield begin
    monkeypatch.undo()


async def test_whoever_asks_when_the_same_beat_is_meant(clock_at: Callable[[float], Clock]) -> None:
    due = []
    for begun_at in (70.0003, 70.0201, 70.0499):
        clock = clock_at(begun_at)
        due.append(await rest(1.0))
        assert 0.0 <= clock.now - due[-1] < 0.001  # never before its due time, and within the loop's millisecond
    assert due == [pytest.approx(71.0)] * 3


async def test_beats_follow_each_other_even_where_the_loop_is_late(clock_at: Callable[[float], Clock]) -> None:
    clock = clock_at(5.0)
    due = []
    for late_s in (0.0, 0.04, 0.03, 0.001):
        clock.now += late_s
        due.append(await rest(BEAT_S))
    assert due == [pytest.approx(5.1), pytest.approx(5.2), pytest.approx(5.3), pytest.approx(5.4)]


async def test_a_rest_is_never_longer_or_shorter_than_asked_by_more_than_half_a_beat(
    clock_at: Callable[[float], Clock],
) -> None:
    for begun_at in (0.0, 1.013, 2.049, 3.051, 4.0999):
        for about_s in (0.1, 0.25, 0.5, 1.0, 60.0):
            clock = clock_at(begun_at)
            await rest(about_s)
            assert abs(clock.slept[0] - about_s) <= BEAT_S / 2 + 0.001
            assert clock.slept[0] > 0


async def test_less_than_a_beat_is_slept_as_it_is(clock_at: Callable[[float], Clock]) -> None:
    clock = clock_at(3.21)
    await rest(0.02)
    assert clock.slept == [pytest.approx(0.02, abs=0.0011)]


async def test_all_conditions_are_looked_at_at_one_go_and_each_waits_for_its_own() -> None:
    looks, asked, due = SharedChecks(every_s=0.01), [], set()

    async def wait_for(name: str) -> str:
        def is_due() -> bool:
            asked.append(name)
            return name in due

        await looks.until(is_due)
        return name

    first, second, third = (asyncio.create_task(wait_for(name)) for name in ("first", "second", "third"))
    async with asyncio.timeout(30):
        while len(asked) < 6:  # noqa: ASYNC110
            await asyncio.sleep(0)
        assert asked[:6] == ["first", "second", "third"] * 2
        due.add("second")
        assert await second == "second"
        assert not first.done()
        third.cancel()
        await asyncio.wait([third])
        asked.clear()
        while len(asked) < 3:  # noqa: ASYNC110
            await asyncio.sleep(0)
        assert set(asked) == {"first"}
        due.add("first")
        assert await first == "first"


async def test_a_condition_that_fails_is_that_of_one_task_only() -> None:
    looks = SharedChecks(every_s=0.01)
    calls = []

    def fails() -> bool:
        raise OSError("no clock")

    failing = asyncio.create_task(looks.until(fails))
    other = asyncio.create_task(looks.until(lambda: bool(calls.append(1)) or len(calls) > 2))
    async with asyncio.timeout(30):
        with pytest.raises(OSError, match="no clock"):
            await failing
        await other


async def test_nothing_wakes_where_nobody_waits() -> None:
    looks = SharedChecks(every_s=0.01)
    loop = asyncio.get_running_loop()
    planned: list[float] = []
    plan = loop.call_later

    def call_later(delay: float, *args: Any, **options: Any) -> asyncio.TimerHandle:
        planned.append(delay)
        return plan(delay, *args, **options)

    loop.call_later = call_later  # type: ignore[method-assign]
    try:
        await looks.until(lambda: True)
        assert len(planned) == 1
    finally:
        loop.call_later = plan  # type: ignore[method-assign]
