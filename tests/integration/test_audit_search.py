"""The search of the audit trail: every filter finds what a plain comparison finds, by an index alone."""

import random
from collections.abc import AsyncIterator
from datetime import UTC, datetime, timedelta
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import delete, event, text
from tower_world import copy_empty_database

from server.audit.store import search
from server.audit.store.search import AuditFilter, page, pages
from server.audit.store.tables import AuditEventRow
from server.storage.database import Database, open_database

NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)
EVENTS = 1200
ACTIONS = ("control.take", "control.give", "controller.x", "user.created", "session.began", "control")
ACTORS = ("Ann", "ben", "Anna_")
DRONES = (None, 1, 2)
FILTERS = [
    AuditFilter(action=action, actor=actor, drone_id=drone_id, since=since, until=until)
    for action, actor, drone_id, (since, until) in product(
        (None, "control.take", "control.", "user.", "none.", "none.x"),
        (None, "ANN", "nobody"),
        (None, 2, 9),
        ((None, None), (NOON + timedelta(hours=3), NOON + timedelta(hours=9))),
    )
]


async def _filled(database: Database) -> list[dict[str, Any]]:
    """Times are not in the order of the ids, and many are equal, as with several towers."""
    chance = random.Random(1)
    rows = [
        {
            "id": number,
            "at": NOON + timedelta(minutes=chance.randrange(700)),
            "actor_name": chance.choice(ACTORS),
            "action": chance.choice(ACTIONS),
            "drone_id": chance.choice(DRONES),
            "detail": {},
            "address": "",
            "request_id": f"request-{number}" if number % 3 == 0 else "",
        }
        for number in range(1, EVENTS + 1)
    ]
    async with database.writing() as session:
        await session.execute(AuditEventRow.__table__.insert(), rows)
    return rows


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "sqlite":
        copy_empty_database(tmp_path / "tower.sqlite3")
        return f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}"
    return str(request.getfixturevalue("migrated_postgres_url")).replace("postgresql://", "postgresql+asyncpg://")


@pytest.fixture
async def database(url: str) -> AsyncIterator[Database]:
    opened = open_database(url)
    yield opened
    await opened.close()


def _matches(row: dict[str, Any], wanted: AuditFilter) -> bool:
    action = wanted.action
    return (
        (action is None or (row["action"].startswith(action) if action.endswith(".") else row["action"] == action))
        and (wanted.actor is None or row["actor_name"].lower() == wanted.actor.lower())
        and (wanted.drone_id is None or row["drone_id"] == wanted.drone_id)
        and (wanted.since is None or row["at"] >= wanted.since)
        and (wanted.until is None or row["at"] < wanted.until)
    )


async def test_every_filter_finds_what_matches_in_pages(database: Database) -> None:
    rows = await _filled(database)
    newest_first = sorted(rows, key=lambda row: (row["at"], row["id"]), reverse=True)
    for wanted in FILTERS:
        expected = [row["id"] for row in newest_first if _matches(row, wanted)]
        found: list[int] = []
        before = None
        while some := await page(database, wanted, before=before, limit=170):
            found += [one.id for one in some]
            before = found[-1]
        assert found == expected, wanted
    exported = [one.id async for some in pages(database, AuditFilter(action="control."), limit=5000) for one in some]
    assert exported == [row["id"] for row in newest_first if row["action"].startswith("control.")]
    (one,) = await page(database, AuditFilter(request_id="request-33"))
    assert one.id == 33
    assert not await page(database, AuditFilter(request_id="request-33", action="none."))


async def test_more_actions_than_can_be_united(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = await _filled(database)
    monkeypatch.setattr(search, "MAX_ACTIONS", 2)
    found = await page(database, AuditFilter(action="control.", actor="ben"), limit=EVENTS)
    expected = {row["id"] for row in rows if row["action"].startswith("control.") and row["actor_name"] == "ben"}
    assert {one.id for one in found} == expected


async def test_the_list_goes_on_after_an_event_that_was_removed(database: Database) -> None:
    await _filled(database)
    (first, second, third) = await page(database, AuditFilter(), limit=3)
    async with database.writing() as session:
        await session.execute(delete(AuditEventRow).where(AuditEventRow.id == second.id))
    after = await page(database, AuditFilter(), before=first.id, limit=1)
    assert [one.id for one in after] == [third.id]
    assert await page(database, AuditFilter(), before=EVENTS + 7, limit=1)


async def test_no_filter_reads_the_whole_table(tmp_path: Path) -> None:
    """SQLite says which index it takes; a scan or a sort of everything would show here, with few rows as with many."""
    copy_empty_database(tmp_path / "tower.sqlite3")
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}")
    try:
        await _filled(database)
        asked: list[tuple[str, Any]] = []

        def remember(_connection: Any, _cursor: Any, statement: str, parameters: Any, *_: Any) -> None:
            if "audit_events" in statement:
                asked.append((statement, parameters))

        event.listen(database.engine.sync_engine, "before_cursor_execute", remember)
        for wanted in [*FILTERS, AuditFilter(request_id="request-33")]:
            await page(database, wanted, before=EVENTS // 2, limit=5)
        event.remove(database.engine.sync_engine, "before_cursor_execute", remember)
        assert len(asked) > len(FILTERS)
        async with database.engine.connect() as connection:
            for statement, parameters in asked:
                plan = (await connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", parameters)).all()
                steps = [row[3] for row in plan]
                for step in steps:
                    assert not step.startswith("SCAN audit_events") or "ix_audit_events" in step, (statement, steps)
            plan = (await connection.execute(text("EXPLAIN QUERY PLAN SELECT * FROM audit_events"))).all()
            assert plan[0][3].startswith("SCAN audit_events"), "the words that the check looks for"
    finally:
        await database.close()
