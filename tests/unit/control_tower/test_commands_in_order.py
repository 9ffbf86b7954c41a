"""Requests that begin operations arrive in the order in which a program made them, also those it has cancelled."""

import asyncio
from typing import Any

import pytest

from control_tower.connection import Connection


class SlowTower(Connection):
    """Answers nothing until it is told to."""

    def __init__(self) -> None:
        super().__init__("https://tower.example.org", "twt_x")
        self.arrived: list[str] = []
        self.answers: dict[str, asyncio.Event] = {}

    async def request(self, method: str, path: str, body: Any = None, **headers: str) -> Any:
        name = body["command"]
        self.arrived.append(name)
        await self.answers.setdefault(name, asyncio.Event()).wait()
        return {"id": name, "drone_id": 1, "work": "command", "state": "running"}

    def answer(self, name: str) -> None:
        self.answers.setdefault(name, asyncio.Event()).set()

    def ask(self, name: str, drone: int = 1) -> asyncio.Task[Any]:
        return asyncio.create_task(self.begin("POST", f"/drones/{drone}/commands", {"command": name}))


async def settled() -> None:
    for _ in range(10):
        await asyncio.sleep(0)


async def test_a_command_waits_for_one_that_was_cancelled_on_its_way() -> None:
    tower = SlowTower()
    going = tower.ask("goto")
    await settled()
    going.cancel()
    returning = tower.ask("rtl")
    await settled()
    assert tower.arrived == ["goto"]
    tower.answer("goto")
    tower.answer("rtl")
    assert (await returning).id == "rtl"
    assert tower.arrived == ["goto", "rtl"]


async def test_a_command_that_was_cancelled_while_it_waited_is_not_sent() -> None:
    tower = SlowTower()
    tower.ask("goto")
    await settled()
    turning = tower.ask("turn")
    await settled()
    turning.cancel()
    tower.answer("goto")
    tower.answer("rtl")
    await tower.ask("rtl")
    assert tower.arrived == ["goto", "rtl"]


async def test_another_drone_does_not_wait() -> None:
    tower = SlowTower()
    tower.ask("goto", drone=1)
    tower.answer("rtl")
    await tower.ask("rtl", drone=2)
    assert tower.arrived == ["goto", "rtl"]


async def test_a_tower_that_does_not_answer_keeps_no_command_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("control_tower.connection.IN_TURN_WITHIN_S", 0.01)
    tower = SlowTower()
    tower.ask("goto")
    await settled()
    tower.answer("rtl")
    async with asyncio.timeout(30):
        await tower.ask("rtl")
    assert tower.arrived == ["goto", "rtl"]
