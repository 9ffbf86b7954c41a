"""What may be true in one round of faults: whose sticks may be at the autopilot's port, and what must be kept."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from typing import Final

import asyncpg  # type: ignore[import-untyped]

from bench.fault_rig import GONE, FaultRig
from bench.person import Person
from bench.tap import ADMIN, OPERATOR, Stick

UNDER_WAY_S: Final = 0.1
"""A frame that passed before the change may be under way for this long: the order to hold goes the same way."""
WRITE_EVERY_S: Final = 0.2


class Truth:
    """The acknowledged changes of the holder, in order."""

    def __init__(self) -> None:
        self._changes: list[tuple[int | None, float, float]] = []
        self._doubts: list[float] = []
        self.epoch = 0
        self.acknowledged = 0
        self.taken_at = float("inf")
        """When the last TAKE was asked for."""

    @property
    def holder(self) -> int | None:
        """Of the last change."""
        return self._changes[-1][0] if self._changes else None

    def changed(self, holder: int | None, asked_at: float, answered_at: float, epoch: int) -> None:
        """A tower has acknowledged it, or the database has it."""
        self._changes.append((holder, asked_at, answered_at))
        self.epoch = epoch
        self.acknowledged += 1
        if holder == ADMIN:
            self.taken_at = asked_at

    def in_doubt(self, asked_at: float) -> None:
        """A request without an answer."""
        self._doubts.append(asked_at)

    def intruders(self, sticks: Sequence[Stick], since: float) -> int:
        """Sticks at the port of somebody who was not the holder then."""
        return sum(1 for one in sticks if one.at > since and one.who in (OPERATOR, ADMIN) and not self._may(one))

    def _may(self, stick: Stick) -> bool:
        for number, (holder, asked_at, _) in enumerate(self._changes):
            following = self._changes[number + 1 :]
            ends_at = following[0][2] + UNDER_WAY_S if following else float("inf")
            if holder == stick.who and asked_at <= stick.at <= ends_at:
                return True
        return False


class Writer:
    """An admin who writes missions all the time, at both towers in turn."""

    def __init__(self, rig: FaultRig) -> None:
        self._rig = rig
        self._task: asyncio.Task[None] | None = None
        self._kept: set[int] = set()

    def begin(self) -> None:
        self._task = asyncio.create_task(self._write())

    async def _write(self) -> None:
        number = 0
        while True:
            number += 1
            with contextlib.suppress(*GONE):
                person = await self._person(number % 2)
                body = {"name": f"field {number}", "document": {"mission": [], "fence": [], "rally": []}}
                async with asyncio.timeout(5):
                    made = await person.ask("POST", "/missions", body)
                self._kept.add(made["id"])
            await asyncio.sleep(WRITE_EVERY_S)

    async def _person(self, number: int) -> Person:
        return await self._rig.person("admin", number)

    async def stop(self) -> None:
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
            self._task = None

    async def end(self) -> tuple[int, int]:
        """Returns how many were acknowledged, and how many of these are not in the database; then deletes them."""
        await self.stop()
        connection = await asyncpg.connect(self._rig.postgres.url)
        try:
            found = {row[0] for row in await connection.fetch("SELECT id FROM missions")}
            await connection.execute("DELETE FROM missions")
        finally:
            await connection.close()
        return len(self._kept), len(self._kept - found)
