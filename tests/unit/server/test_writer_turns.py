"""Who writes next: changes of who flies first, then the persons in turns."""

from __future__ import annotations

import asyncio

import pytest

from server.storage.writer_turns import WriterTurns, write_as


class Writers:
    """Writers that note when it is their turn."""

    def __init__(self) -> None:
        self.turns = WriterTurns()
        self.wrote: list[str] = []
        self.tasks: list[asyncio.Task[None]] = []

    async def write(self, name: str, user_id: int, *, first: bool = False, within_s: float = 20.0) -> None:
        write_as(user_id)
        async with self.turns.turn(within_s, first=first):
            self.wrote.append(name)
            await asyncio.sleep(0)

    async def begin(self, name: str, user_id: int, *, first: bool = False) -> asyncio.Task[None]:
        task = asyncio.create_task(self.write(name, user_id, first=first))
        self.tasks.append(task)
        await asyncio.sleep(0)
        return task


async def test_a_change_of_who_flies_is_next_and_the_others_have_turns() -> None:
    writers = Writers()
    async with writers.turns.turn(1.0, first=False):
        for number in range(3):
            await writers.begin(f"noisy {number}", 1)
        await writers.begin("calm", 2)
        await writers.begin("the tower", 0)
        await writers.begin("take", 3, first=True)
    await asyncio.gather(*writers.tasks)
    assert writers.wrote == ["take", "noisy 0", "calm", "the tower", "noisy 1", "noisy 2"]


async def test_who_gives_up_or_fails_stops_nobody() -> None:
    writers = Writers()
    async with writers.turns.turn(1.0, first=False):
        left = await writers.begin("left", 1)
        await writers.begin("stays", 1)
        with pytest.raises(TimeoutError):
            await writers.write("late", 2, within_s=0.01)
        left.cancel()
    await asyncio.gather(*writers.tasks, return_exceptions=True)
    assert writers.wrote == ["stays"]
    with pytest.raises(ZeroDivisionError):
        async with writers.turns.turn(1.0, first=False):
            raise ZeroDivisionError
    async with writers.turns.turn(1.0, first=False):
        pass


async def test_a_turn_that_comes_at_the_moment_of_the_end_is_passed_on() -> None:
    writers = Writers()
    async with writers.turns.turn(1.0, first=False):
        left = await writers.begin("left", 1)
        await writers.begin("stays", 2)
    left.cancel()  # its turn has come, and it has not run yet
    await asyncio.gather(*writers.tasks, return_exceptions=True)
    assert writers.wrote == ["stays"]
