"""A failed sign-in costs as much work as a successful one, whether the name exists or not; and how attempts are
counted.

Measured in operations, not in time: on a busy machine the time proves nothing.
"""

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest
from tower_world import PASSWORD, MovableClock, Person, TowerWorld, assert_problem, start_tower

from server.accounts.core.throttle import FREE_TRIES, FREE_TRIES_OF_ADDRESS
from server.accounts.store.hashing_process import Hashing
from server.kernel.people import Role

SESSION = "/api/v1/session"


@pytest.fixture
async def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[TowerWorld]:
    """The tower's clock stands still, however long the requests take."""
    now = datetime.now(UTC)
    monkeypatch.setattr(MovableClock, "__call__", lambda _: now)
    async with start_tower(tmp_path, trusted_proxies="127.0.0.1") as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


class Spy:
    """Records the hashing requests: (verify or hash, the cost parameters of the compared hash)."""

    def __init__(self, hashing: Hashing) -> None:
        self._hashing = hashing
        self.work: list[tuple[str, str]] = []

    async def ask(self, question: dict[str, Any]) -> str | bool:
        known = question.get("hash")
        self.work.append(("hash", "") if known is None else ("verify", known.rsplit("$", 2)[0]))
        return await self._hashing.ask(question)

    async def close(self) -> None:
        await self._hashing.close()


async def try_once(world: TowerWorld, name: str, password: str = "wrong", address: str = "") -> httpx.Response:
    headers = {"X-Forwarded-For": address} if address else {}
    return await (await world.client()).post(SESSION, json={"name": name, "password": password}, headers=headers)


@pytest.mark.parametrize("name", ["Anna", "Nobody", "", "x" * 900, "Gone", "\u202e"])
async def test_every_miss_does_the_same_work(
    world: TowerWorld, anna: Person, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    gone = await world.add_user("Gone")
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    assert (await root.patch(f"/api/v1/users/{gone.id}", json={"disabled": True})).status_code == 200
    spy = Spy(world.tower.passwords._hashing)
    monkeypatch.setattr(world.tower.passwords, "_hashing", spy)
    assert_problem(await try_once(world, name), 401, "wrong-sign-in")
    (miss,) = spy.work
    spy.work.clear()
    assert (await try_once(world, "Anna", PASSWORD)).status_code == 200
    assert spy.work == [miss], "a hit takes one verification of a hash of the same costs, and nothing else"


async def statuses(world: TowerWorld, *tries: tuple[str, str]) -> list[int]:
    return [(await try_once(world, name, address=address)).status_code for name, address in tries]


async def test_a_name_from_an_address_waits_alone(world: TowerWorld, anna: Person) -> None:
    here, there = "203.0.113.1", "203.0.113.2"
    assert await statuses(world, *[("Anna", here)] * FREE_TRIES) == [401] * FREE_TRIES
    assert await statuses(world, ("Anna", here), ("aNNA", here)) == [429, 429], "however it is spelt"
    assert await statuses(world, ("Nobody", here), ("Anna", there)) == [401, 401], "others, and from elsewhere, do not"
    assert (await try_once(world, "Anna", PASSWORD, there)).status_code == 200
    assert await statuses(world, ("Anna", here)) == [429], "nobody clears it for another address"


async def test_an_unknown_name_waits_like_a_known_one(world: TowerWorld, anna: Person) -> None:
    tries = FREE_TRIES + 1
    known = await statuses(world, *[("Anna", "203.0.113.1")] * tries)
    unknown = await statuses(world, *[("Nobody", "203.0.113.2")] * tries)
    assert known == unknown == [401] * FREE_TRIES + [429]


async def test_an_address_that_tries_many_names_waits_with_all_of_them(world: TowerWorld, anna: Person) -> None:
    here = "203.0.113.1"
    sprayed = [(f"name {number}", here) for number in range(FREE_TRIES_OF_ADDRESS)]
    assert await statuses(world, *sprayed) == [401] * FREE_TRIES_OF_ADDRESS
    assert await statuses(world, ("one more", here), ("Anna", here), ("Anna", "203.0.113.2")) == [429, 429, 401]


async def test_a_try_that_waits_costs_no_hash(world: TowerWorld, anna: Person, monkeypatch: pytest.MonkeyPatch) -> None:
    await statuses(world, *[("Anna", "203.0.113.1")] * FREE_TRIES)
    spy = Spy(world.tower.passwords._hashing)
    monkeypatch.setattr(world.tower.passwords, "_hashing", spy)
    assert await statuses(world, *[("Anna", "203.0.113.1")] * 3) == [429] * 3
    assert spy.work == []
