"""Many concurrent writers, and others that lock the database: no writer is locked out, and nothing is lost."""

import asyncio
import sqlite3
from collections.abc import AsyncIterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import event, select, text
from sqlalchemy.exc import OperationalError
from tower_world import copy_empty_database

from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.fleet.store import enrolments
from server.fleet.store.drones import create_drone
from server.fleet.store.enrolment_notifier import EnrolmentNotifier
from server.fleet.store.tables import EnrolmentRow
from server.storage.database import Database, DatabaseUnavailable, open_database
from wire.ids import DroneId

NOW = datetime(2026, 11, 22, 2, 0, tzinfo=UTC)
CROWD = 1200
"""More than twice `enrolments.MAX_CONCURRENT`."""


@pytest.fixture
async def database(tmp_path: Path) -> AsyncIterator[Database]:
    copy_empty_database(tmp_path / "tower.sqlite3")
    opened = open_database(f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}")
    # Fails if a writer of this process waits for another in SQLite itself.
    event.listen(opened.engine.sync_engine, "connect", lambda one, _: one.execute("PRAGMA busy_timeout = 20"))
    yield opened
    await opened.close()


class Screen:
    """An admin's browser."""

    def __init__(self) -> None:
        self.reported: list[tuple[int, str]] = []
        self.news = asyncio.Event()

    def notify_admins_of_enrolment(self, enrolment: dict[str, Any]) -> None:
        self.reported.append((enrolment["drone"]["id"], enrolment["state"]))
        self.news.set()

    async def until_received(self, times: int) -> None:
        async with asyncio.timeout(20):
            while len(self.reported) < times:
                self.news.clear()
                await self.news.wait()


async def add_used(database: Database, *names: str, used_at: datetime = NOW) -> list[DroneId]:
    """Adds drones whose enrolments were used, but whose agents have not connected yet."""
    ids = []
    async with database.writing() as session:
        for name in names:
            action = AuditAction(by=COMMAND_LINE, at=NOW)
            drone = await create_drone(session, name=name, action=action)
            _, _, token, _ = await enrolments.begin(session, drone_id=drone.id, lasts_s=60, action=action)
            await enrolments.use(session, token=token, public_key=drone.id.to_bytes(32), at=used_at, address="")
            ids.append(DroneId(drone.id))
    return ids


async def seen_at(database: Database) -> dict[int, datetime | None]:
    async with database.reading() as session:
        return {row.drone_id: row.agent_seen_at for row in await session.scalars(select(EnrolmentRow))}


async def test_of_a_crowd_of_writers_nobody_is_locked_out(database: Database) -> None:
    await add_used(database, "hawk")

    async def write() -> None:
        async with database.writing() as session:
            await session.execute(text("UPDATE enrolments SET used_from = used_from || 'x'"))
            await asyncio.sleep(0.002)

    await asyncio.gather(*(write() for _ in range(60)))
    async with database.reading() as session:
        assert await session.scalar(text("SELECT length(used_from) FROM enrolments")) == 60


async def test_a_writer_that_is_stuck_keeps_the_others_for_so_long_and_no_longer(database: Database) -> None:
    database = Database(database.engine, timeout_s=0.3)
    async with database.writing():
        with pytest.raises(DatabaseUnavailable):
            async with database.writing():
                pytest.fail("two writers at once")
        async with database.reading() as session:
            assert await session.scalar(text("SELECT 1")) == 1
    async with database.writing():
        pass


async def test_a_thousand_agents_that_link_at_once_are_one_question_for_hundreds_of_them(database: Database) -> None:
    hawk, owl = await add_used(database, "hawk", "owl")
    (late,) = await add_used(database, "used after its agent linked", used_at=NOW + timedelta(seconds=1))
    begun: list[str] = []
    event.listen(database.engine.sync_engine, "begin", lambda connection: begun.append(_how(connection)))
    screen = Screen()
    news = EnrolmentNotifier(database, screen, lambda: NOW)  # type: ignore[arg-type]
    for number in range(CROWD):
        news.agent_linked(DroneId(1_000_000 + number))
    for drone_id in (hawk, owl, late):
        news.agent_linked(drone_id)
    await screen.until_received(2)
    assert sorted(screen.reported) == [(hawk, "seen"), (owl, "seen")]
    assert await seen_at(database) == {hawk: NOW, owl: NOW, late: None}
    news.agent_linked(hawk)
    news.publish(1)
    await screen.until_received(3)
    assert begun.count("BEGIN IMMEDIATE") == 1, "nothing is written for agents that come back"
    assert len(begun) <= 10
    await news.stop()


async def test_news_wait_for_a_database_that_somebody_else_keeps_locked(database: Database, tmp_path: Path) -> None:
    (hawk,) = await add_used(database, "hawk")
    tried: list[str] = []
    given_up = asyncio.Event()

    def failed(context: Any) -> None:
        if isinstance(context.sqlalchemy_exception, OperationalError):
            tried.append("locked")
            if len(tried) == 3:
                given_up.set()

    event.listen(database.engine.sync_engine, "handle_error", failed)
    screen = Screen()
    news = EnrolmentNotifier(database, screen, lambda: NOW, try_again_after_s=0.01)  # type: ignore[arg-type]
    other = sqlite3.connect(tmp_path / "tower.sqlite3", isolation_level=None)
    try:
        other.execute("BEGIN IMMEDIATE")
        news.agent_linked(hawk)
        await asyncio.wait_for(given_up.wait(), 20)
        assert screen.reported == []
    finally:
        other.rollback()
        other.close()
    await screen.until_received(1)
    assert screen.reported == [(hawk, "seen")]
    await news.stop()


def _how(connection: Any) -> str:
    return str(connection.get_execution_options().get("tower_begin", "BEGIN"))
