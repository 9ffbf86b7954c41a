"""Attacks on the sign-in lock nobody out. `tests/attacks` floods it beside a flight.

This program is the proxy: 127.0.0.1 is trusted and reports client addresses, so requests can have IPv6 addresses.
"""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from tower_world import PASSWORD, Person, TowerWorld, start_tower

from bench.attackers import post_sign_in
from server.anonymous.core.limits import LIMITS
from server.anonymous.core.networks import origin_of

STRANGER = "127.77.0.1"
"""Not a trusted proxy."""


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    # Hashes as slow as in production: with fast ones the queue never fills.
    async with start_tower(tmp_path, argon2_memory_kib=65_536, argon2_rounds=8, argon2_process=True) as running:
        yield running


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


def sign_in(client: httpx.AsyncClient, address: str, name: str, password: str) -> asyncio.Task[httpx.Response]:
    """Sends a sign-in as a proxy forwards it."""
    return asyncio.create_task(
        client.post("/api/v1/session", json={"name": name, "password": password}, headers={"X-Forwarded-For": address})
    )


async def test_what_a_stranger_says_of_where_they_come_from_is_not_believed(world: TowerWorld, anna: Person) -> None:
    """Otherwise each try could claim another address, even the known address of a user."""
    transport = httpx.AsyncHTTPTransport(local_address=STRANGER)
    async with httpx.AsyncClient(base_url=world.base_url, transport=transport, timeout=20) as stranger:
        # All at once: the delay after the fifth is shorter than a busy machine takes for a hash.
        tries = [sign_in(stranger, f"203.0.113.{number}", anna.name, "wrong") for number in range(8)]
        answers = await asyncio.gather(*tries)
    assert Counter(one.status_code for one in answers) == {401: 5, 429: 3}
    assert await post_sign_in(world.base_url, anna.name, PASSWORD, "127.78.0.1") == 200
    assert not world.tower.anonymous.known.knows(origin_of("203.0.113.1"))


async def test_guessing_at_a_name_does_not_lock_its_owner_out(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:  # fast hashes: only the number of tries counts here
        anna = await world.add_user("Anna")
        proxy = await world.client()
        assert (await sign_in(proxy, "192.0.2.1", anna.name, PASSWORD)).status_code == 200
        statuses = Counter[int]()
        for number in range(LIMITS.guesses_per_name_per_hour + 20):
            answer = await sign_in(proxy, f"10.{number}.0.1", anna.name, f"guess {number}")
            statuses[answer.status_code] += 1
        assert 0 < statuses[401] <= LIMITS.guesses_per_name_per_hour
        assert statuses[429] >= 20
        assert (await sign_in(proxy, "192.0.2.1", anna.name, PASSWORD)).status_code == 200


async def test_addresses_are_known_again_after_a_restart(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        anna = await world.add_user("Anna")
        proxy = await world.client()
        assert (await sign_in(proxy, "192.0.2.1", anna.name, PASSWORD)).status_code == 200
    async with start_tower(tmp_path) as world:
        assert world.tower.anonymous.known.knows(origin_of("192.0.2.1"), "anna")
        assert not world.tower.anonymous.known.knows(origin_of("192.0.2.2"), "anna")


async def test_the_process_that_hashes_comes_back(world: TowerWorld, anna: Person) -> None:
    hashing = world.tower.passwords._hashing
    process = hashing._process  # type: ignore[attr-defined]
    assert process is not None
    process.kill()
    await process.wait()
    statuses = [await post_sign_in(world.base_url, anna.name, PASSWORD, STRANGER) for _ in range(2)]
    assert statuses[-1] == 200
    assert hashing._process is not process  # type: ignore[attr-defined]
