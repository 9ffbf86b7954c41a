"""The audit trail with filters and as a table, and the tower's own state."""

import csv
from collections.abc import AsyncIterator
from datetime import timedelta
from io import StringIO
from pathlib import Path

import httpx
import pytest
from control_world import live
from tower_world import TowerWorld, assert_problem, start_tower

from server.audit.store.search import ROWS_AT_ONCE
from server.audit.store.trail import Actor, record
from server.kernel.people import Role

AUDIT = "/api/v1/audit"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


async def write(world: TowerWorld, number: int, **fields: object) -> None:
    now = world.clock()
    async with world.database.writing() as session:
        for index in range(number):
            values = {"actor": Actor(None, "Eve"), "action": "test.done"} | fields
            record(session, at=now - timedelta(hours=1, seconds=index), **values)  # type: ignore[arg-type]


async def test_filters(world: TowerWorld, root: httpx.AsyncClient) -> None:
    await write(world, 3)
    await write(world, 2, action="test.other", drone_id=7)
    await write(world, 1, action="tester.x", actor=Actor(None, "Ann_"))
    hour_ago = (world.clock() - timedelta(minutes=30)).isoformat()

    async def count(**parameters: str | int) -> int:
        answer = await root.get(AUDIT, params=parameters)
        assert answer.status_code == 200, answer.text
        return len(answer.json())

    assert await count(action="test.") == 5
    assert await count(action="test.done") == 3
    assert await count(action="tes") == 0
    assert await count(action="t%.") == 0
    assert await count(actor="eVE") == 5
    assert await count(actor="Ann%") == 0
    assert await count(drone_id=7) == 2
    assert await count(drone_id=7, actor="Ann_") == 0
    assert await count(until=hour_ago) == 6
    assert await count(since=hour_ago, action="test.") == 0
    assert_problem(await root.get(AUDIT, params={"since": "yesterday"}), 422, "invalid-request")
    assert_problem(await root.get(AUDIT, params={"since": "2026-01-01T00:00:00"}), 422, "invalid-request")


async def test_the_table_has_every_event_once_and_no_formula(world: TowerWorld, root: httpx.AsyncClient) -> None:
    await write(world, ROWS_AT_ONCE + 5, detail={"words": 'a "quoted",\nline'})
    await write(world, 1, actor=Actor(None, "=cmd()"), action="test.formula")
    answer = await root.get(f"{AUDIT}.csv", params={"action": "test."})
    assert answer.headers["content-type"].startswith("text/csv")
    assert "attachment" in answer.headers["content-disposition"]
    rows = list(csv.DictReader(StringIO(answer.text)))
    assert len(rows) == ROWS_AT_ONCE + 6
    assert len({row["id"] for row in rows}) == len(rows)
    assert rows[0]["actor_name"] == "'=cmd()"
    assert "quoted" in rows[1]["detail"]


async def test_the_system_says_how_it_is(world: TowerWorld, root: httpx.AsyncClient) -> None:
    await world.add_drone("hawk")
    reported = (await root.get("/api/v1/system")).json()
    assert reported["database"]["kind"] == "sqlite"
    assert reported["database"]["size_bytes"] > 0
    assert reported["agents"] == {"known": 1, "online": 0}
    assert reported["clients"] == {"live": 0, "users": 0}
    assert 0 < reported["disk"]["free_bytes"] <= reported["disk"]["total_bytes"]
    assert reported["memory_bytes"] > 10_000_000
    operator = await world.signed_in(await world.add_user("Anna"))
    assert_problem(await operator.get("/api/v1/system"), 403, "admins-only")


async def test_admins_see_who_is_online(world: TowerWorld, root: httpx.AsyncClient) -> None:
    anna = await world.add_user("Anna")
    operator = await world.signed_in(anna)
    assert (await root.get("/api/v1/online")).json() == []
    async with live(world, operator), live(world, operator), live(world, root):
        reported = (await root.get("/api/v1/online")).json()
        assert [(one["user"]["name"], one["connections"]) for one in reported] == [("Anna", 2), ("Root", 1)]
        assert reported[0]["user"]["id"] == anna.id
    assert_problem(await operator.get("/api/v1/online"), 403, "admins-only")
