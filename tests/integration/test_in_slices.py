"""Long reads and long lists let other work go on between their slices."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

from pydantic import BaseModel
from sqlalchemy import literal_column, select
from sqlalchemy.sql import union_all
from tower_world import start_tower

from server.http.long_list import long_list
from server.storage.in_slices import in_slices, slices


class Turns:
    """Counts the turns of the loop that others had."""

    def __init__(self) -> None:
        self.count = 0
        self._task = asyncio.create_task(self._go())

    async def _go(self) -> None:
        while True:
            await asyncio.sleep(0)
            self.count += 1

    def stop(self) -> int:
        self._task.cancel()
        return self.count


class Entry(BaseModel):
    number: int


async def test_many_rows_are_read_in_slices(tmp_path: Path) -> None:
    numbers = union_all(*(select(literal_column(str(number)).label("number")) for number in range(100))).subquery()
    async with start_tower(tmp_path) as world, world.database.reading() as session:
        turns = Turns()
        found, seen = [], []
        async for some in slices(session, select(numbers.c.number), rows=5):
            found += [row.number for row in some]
            seen.append(turns.count)
        turns.stop()
        assert sorted(found) == list(range(100))
        assert len(set(seen)) == 20
        assert await in_slices(session, select(numbers.c.number)) == [(number,) for number in found]


async def test_a_long_list_is_made_in_slices() -> None:
    turns = Turns()
    made = (Entry(number=number) for number in range(100))
    answer = await long_list(made, at_once=5)
    assert answer.body == b"[" + b",".join(b'{"number":%d}' % number for number in range(100)) + b"]"
    assert turns.stop() >= 19
    assert (await long_list([])).body == b"[]"


async def test_views_of_rows_that_are_still_being_read_become_one_list() -> None:
    turns = Turns()

    async def read() -> AsyncIterator[Entry]:
        for number in range(20):
            yield Entry(number=number)

    answer = await long_list(read(), at_once=5)
    assert answer.body == b"[" + b",".join(b'{"number":%d}' % number for number in range(20)) + b"]"
    assert turns.stop() >= 3
