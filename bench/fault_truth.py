"""What may be true in one round of faults: whose sticks may be at the autopilot's port, and what must be kept."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping, Sequence
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
        """Holder, asked at, answered at."""
        self._in_doubt_since: dict[int, float] = {}
        """When the change with this index may have happened, if a request before the acknowledged one is in doubt."""
        self._doubts: dict[int | None, float] = {}
        """When each holder asked first since the last change, without a certain answer."""
        self.epoch = 0
        self.acknowledged = 0
        self.taken_at = float("inf")
        """When the last TAKE was asked for."""

    @property
    def holder(self) -> int | None:
        """Of the last change."""
        return self._changes[-1][0] if self._changes else None

    def changed(self, holder: int | None, asked_at: float, answered_at: float, epoch: int) -> None:
        """A tower has acknowledged it, or the database has it: perhaps since an earlier request in doubt."""
        if holder in self._doubts:
            self._in_doubt_since[len(self._changes)] = self._doubts[holder]
        self._doubts.clear()
        self._changes.append((holder, asked_at, answered_at))
        self.epoch = epoch
        self.acknowledged += 1
        if holder == ADMIN:
            self.taken_at = asked_at

    def in_doubt(self, holder: int | None, asked_at: float) -> None:
        """A request without an answer, or whose answer says that its outcome is not known."""
        self._doubts.setdefault(holder, asked_at)

    def intruders(self, sticks: Sequence[Stick], since: float) -> list[Stick]:
        """Sticks at the port of somebody who was not the holder then."""
        of_people = [one for one in sticks if one.at > since and one.who in (OPERATOR, ADMIN)]
        return [one for one in of_people if not self._may(one, self._in_doubt_since)]

    def after_doubt(self, sticks: Sequence[Stick], since: float) -> list[Stick]:
        """Those that are an intruder's unless a request whose outcome was not known has been carried out."""
        of_people = [one for one in sticks if one.at > since and one.who in (OPERATOR, ADMIN)]
        return [one for one in of_people if self._may(one, self._in_doubt_since) and not self._may(one, {})]

    def in_words(self, sticks: Sequence[Stick], since: float) -> str:
        """When each of these sticks came, and when each change was asked for and answered."""
        came = ", ".join(f"{one.who} at {one.at - since:.3f}" for one in sticks)
        changes = ", ".join(
            f"{holder} asked {asked_at - since:.3f} answered {answered_at - since:.3f}"
            for holder, asked_at, answered_at in self._changes
        )
        return f"sticks: {came}; changes: {changes} (s after the fault)"

    def _may(self, stick: Stick, in_doubt_since: Mapping[int, float]) -> bool:
        for number, (holder, asked_at, _) in enumerate(self._changes):
            begins_at = in_doubt_since.get(number, asked_at)
            following = self._changes[number + 1 :]
            ends_at = following[0][2] + UNDER_WAY_S if following else float("inf")
            if holder == stick.who and begins_at <= stick.at <= ends_at:
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
