"""Strangers behind a trusted proxy are counted by their own address, whichever of the proxy's connections they use.

This program is the proxy; httpx gives it a pool of connections, as a real one has. Requests from strangers start slowly
enough to show the order of service.
"""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import httpx
import pytest
from control_world import until
from tower_world import PASSWORD, TowerWorld, start_tower

from server.anonymous.core.budget import AnonymousBudget, Over
from server.anonymous.core.limits import LIMITS
from server.anonymous.core.networks import origin_of
from server.app import composition as app

PATH: Final = "/api/v1/health"
SLOW: Final = replace(LIMITS, requests_per_s=5.0)
FLOOD: Final = 100
FLOODER: Final = "198.51.100.7"
KNOWN: Final = "192.0.2.1"
UNTRUSTED: Final = "127.77.0.1"


@pytest.fixture
async def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[TowerWorld]:
    monkeypatch.setattr(app, "AnonymousBudget", partial(AnonymousBudget, limits=SLOW))
    async with start_tower(tmp_path) as running:
        yield running


@asynccontextmanager
async def proxy(world: TowerWorld, local_address: str | None = None) -> AsyncIterator[httpx.AsyncClient]:
    transport = httpx.AsyncHTTPTransport(local_address=local_address, limits=httpx.Limits(max_connections=None))
    async with httpx.AsyncClient(base_url=world.base_url, transport=transport, timeout=30) as client:
        yield client


async def status(through: httpx.AsyncClient, address: str) -> int:
    """Returns the status of a request from this address."""
    return (await through.get(PATH, headers={"X-Forwarded-For": address})).status_code


@asynccontextmanager
async def flood(world: TowerWorld, through: httpx.AsyncClient, *addresses: str) -> AsyncIterator[Counter[int]]:
    """Sends more requests than may wait for one address. Yields the statuses so far, once many of the rest wait."""
    statuses: Counter[int] = Counter()

    async def one(number: int) -> None:
        statuses[await status(through, addresses[number % len(addresses)])] += 1

    asking = [asyncio.create_task(one(number)) for number in range(FLOOD)]
    try:
        await until("the line", lambda: waiting(world) >= SLOW.max_waiting_requests_per_address - 5)
        yield statuses
    finally:
        for task in asking:
            task.cancel()
        await asyncio.gather(*asking, return_exceptions=True)


def waiting(world: TowerWorld) -> int:
    return world.tower.anonymous.waiting["requests"]


async def test_a_flood_through_the_proxy_takes_the_turns_of_nobody_else(world: TowerWorld) -> None:
    async with proxy(world) as through:
        async with flood(world, through, FLOODER) as statuses:
            others = [status(through, f"203.0.{number}.1") for number in range(5)]
            assert await asyncio.gather(*others) == [200] * 5
            assert waiting(world) > SLOW.max_waiting_requests_per_address // 2, "they did not wait for the flood's end"
            assert await status(through, "2001:db8::1") == 200
            await until("refusals", lambda: statuses[429] > 0)
        assert world.tower.anonymous.refused[Over.REQUESTS] > 0


async def test_somebody_known_behind_the_proxy_does_not_wait(world: TowerWorld) -> None:
    anna = await world.add_user("Anna")
    async with proxy(world) as through:
        signed_in = await through.post(
            "/api/v1/session", json={"name": anna.name, "password": PASSWORD}, headers={"X-Forwarded-For": KNOWN}
        )
        assert signed_in.status_code == 200
        assert world.tower.anonymous.known.knows(origin_of(KNOWN))
        assert not world.tower.anonymous.known.knows(origin_of(FLOODER)), "the connection is the proxy's, not hers"
        through.cookies.clear()
        async with flood(world, through, FLOODER) as statuses:
            served = statuses[200]
            for _ in range(20):
                assert await status(through, KNOWN) == 200
            assert statuses[200] - served < 15, "hers were not one for one with those of the flood"
            await until("refusals", lambda: statuses[429] > 0)


async def test_the_proxy_says_who_it_is_and_nobody_else(world: TowerWorld) -> None:
    """Entries that the client itself writes are to the left of the one that the proxy adds."""
    forged = [f"203.0.{number}.1, {FLOODER}" for number in range(50)]
    async with proxy(world) as through, flood(world, through, *forged) as statuses:
        await until("refusals", lambda: statuses[429] > 0)


async def test_a_proxy_that_is_not_trusted_is_one_stranger_for_all_of_its_clients(world: TowerWorld) -> None:
    clients = [f"203.0.{number}.1" for number in range(FLOOD)]
    async with proxy(world, UNTRUSTED) as through, flood(world, through, *clients) as statuses:
        await until("refusals", lambda: statuses[429] > 0)


async def test_many_clients_of_the_proxy_are_not_one(world: TowerWorld) -> None:
    clients = [f"203.0.{number}.1" for number in range(FLOOD)]
    async with proxy(world) as through, flood(world, through, *clients) as statuses:
        await until("some answers", lambda: statuses[200] >= 15)
        assert set(statuses) == {200}
    assert world.tower.anonymous.refused[Over.REQUESTS] == 0
