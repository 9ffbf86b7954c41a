"""The thread for long work of requests: turns, limits, and those who no longer wait."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable

import pytest

from server.runtime.side_thread import MAX_WAITING, TOWERS_OWN, SideThread, TooMuchWork


@pytest.fixture
async def side() -> AsyncIterator[SideThread]:
    thread = SideThread("side")
    yield thread
    thread.close()


class Gate:
    """Keeps the thread until it is opened, and notes what ran after it, in order."""

    def __init__(self) -> None:
        self.opened = threading.Event()
        self.ran: list[str] = []

    def note(self, name: str) -> Callable[[], str]:
        def work() -> str:
            self.ran.append(name)
            return name

        return work


async def closed(side: SideThread, gate: Gate) -> asyncio.Task[bool]:
    """The thread is busy until the gate opens."""
    task = asyncio.ensure_future(side.in_turn(TOWERS_OWN, lambda: gate.opened.wait(20)))
    await asyncio.sleep(0)
    return task


async def test_answers_and_errors_come_back(side: SideThread) -> None:
    assert await side.in_turn(1, lambda: threading.current_thread().name.split("_")[0]) == "side"
    with pytest.raises(ZeroDivisionError):
        await side.in_turn(1, lambda: 1 // 0)
    assert await side.in_turn(1, lambda: 2) == 2


async def test_a_person_with_much_work_waits_and_the_others_do_not(side: SideThread) -> None:
    gate = Gate()
    first = await closed(side, gate)
    asked = [asyncio.ensure_future(side.in_turn(1, gate.note(f"alice {n}"))) for n in range(3)]
    await asyncio.sleep(0)
    asked += [asyncio.ensure_future(side.in_turn(2, gate.note("bob")))]
    asked += [asyncio.ensure_future(side.in_turn(3, gate.note("carol")))]
    await asyncio.sleep(0)
    gate.opened.set()
    await asyncio.gather(first, *asked)
    assert gate.ran == ["alice 0", "bob", "carol", "alice 1", "alice 2"]


async def test_a_person_and_all_together_may_wait_for_so_much_and_no_more(side: SideThread) -> None:
    gate = Gate()
    waiting: list[asyncio.Future[object]] = [await closed(side, gate)]
    for person in range(1, MAX_WAITING // 4 + 1):
        waiting += [asyncio.ensure_future(side.in_turn(person, lambda: None)) for _ in range(4)]
    await asyncio.sleep(0)
    for person, whose in ((1, "you already wait"), (99, "the tower is busy")):
        with pytest.raises(TooMuchWork, match=whose):
            await side.in_turn(person, lambda: None)
    waiting.append(asyncio.ensure_future(side.in_turn(TOWERS_OWN, lambda: None)))
    gate.opened.set()
    await asyncio.gather(*waiting)


async def test_who_has_left_loses_the_turn(side: SideThread) -> None:
    gate = Gate()
    first = await closed(side, gate)
    left = asyncio.ensure_future(side.in_turn(1, gate.note("left")))
    stays = asyncio.ensure_future(side.in_turn(1, gate.note("stays")))
    await asyncio.sleep(0)
    left.cancel()
    gate.opened.set()
    await asyncio.gather(first, stays)
    assert gate.ran == ["stays"]


async def test_what_work_took_is_charged_to_its_person_also_where_it_fails() -> None:
    spent: list[tuple[int, float]] = []
    side = SideThread("side", on_spent=lambda user_id, seconds: spent.append((user_id, seconds)))

    def fails() -> None:
        until = time.thread_time() + 0.02
        while time.thread_time() < until:
            pass
        raise ValueError("not a file")

    with pytest.raises(ValueError, match="not a file"):
        await side.in_turn(3, fails)
    assert await side.in_turn(TOWERS_OWN, lambda: 5) == 5
    ((user_id, seconds),) = spent
    assert user_id == 3
    assert seconds >= 0.02
    side.close()
