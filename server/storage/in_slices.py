"""Many rows, read a few at a time. Between two slices the event loop passes frames on: to make objects of 15,000 rows
kept it for a quarter of a second (`python -m bench worst`)."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from typing import Final, TypeVarTuple

from sqlalchemy import Row, Select
from sqlalchemy.ext.asyncio import AsyncSession

ROWS: Final = 100
"""Of a slice: with two objects in each row, two milliseconds."""

Columns = TypeVarTuple("Columns")


async def slices(
    session: AsyncSession, statement: Select[*Columns], *, rows: int = ROWS
) -> AsyncIterator[Sequence[Row[*Columns]]]:
    """Yields all rows of the statement."""
    async for some in (await session.stream(statement.execution_options(yield_per=rows))).partitions():
        yield some
        await asyncio.sleep(0)  # the driver has read ahead: the next slice may be there already


async def in_slices(session: AsyncSession, statement: Select[*Columns], *, rows: int = ROWS) -> list[Row[*Columns]]:
    """All rows of the statement."""
    return [row async for some in slices(session, statement, rows=rows) for row in some]
