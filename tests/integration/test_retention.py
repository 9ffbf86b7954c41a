"""Retention: what is too old or too much goes in small steps, and nothing else does."""

import os
from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path

import pytest
from control_world import until
from sqlalchemy import event, func, select
from tower_world import TowerWorld, start_tower

from server.alerts.store.tables import AlertRow
from server.audit.store import sealer
from server.audit.store.tables import AuditEventRow
from server.audit.store.trail import Actor, record
from server.storage import retention
from server.video.store.tables import RecordingRow

DAY_S = 86_400.0


@pytest.fixture
async def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[TowerWorld]:
    monkeypatch.setattr(retention, "EVENTS_A_STEP", 20)
    monkeypatch.setattr(retention, "FILES_A_STEP", 2)
    monkeypatch.setattr(retention, "PAUSE_S", 0.01)
    monkeypatch.setattr(retention, "CHECK_EVERY_S", 0.05)
    monkeypatch.setattr(sealer, "LOOK_EVERY_S", 0.05)
    limits = {
        "alerts_keep_days": 10.0,
        "audit_keep_days": 10.0,
        "flight_logs_keep_days": 10.0,
        "recordings_keep_days": 10.0,
    }
    async with start_tower(tmp_path, audit_most_events=300, **limits) as running:
        yield running


async def _events(world: TowerWorld, action: str) -> int:
    async with world.database.reading() as session:
        rows = select(func.count()).select_from(AuditEventRow).where(AuditEventRow.action == action)
        return int(await session.scalar(rows) or 0)


async def _write(world: TowerWorld, action: str, count: int, *, days_ago: float) -> None:
    async with world.database.writing() as session:
        for _ in range(count):
            record(session, at=world.clock() - timedelta(days=days_ago), actor=Actor(None, "Ann"), action=action)


async def test_old_and_surplus_audit_events_go(world: TowerWorld) -> None:
    largest = 0

    def watch(_connection: object, _cursor: object, statement: str, parameters: tuple[object, ...], *_: object) -> None:
        nonlocal largest
        if statement.startswith("DELETE FROM audit_events"):
            largest = max(largest, len(parameters))

    event.listen(world.database.engine.sync_engine, "before_cursor_execute", watch)
    await _write(world, "test.new", 5, days_ago=9)
    await _write(world, "test.old", 95, days_ago=11)
    removed = world.tower.retention.removed
    await until("the old ones to go", lambda: removed["audit_events"] == 95)
    assert (await _events(world, "test.old"), await _events(world, "test.new")) == (0, 5)
    await _write(world, "test.many", 330, days_ago=1)

    async with world.database.reading() as session:
        newest = await session.scalar(select(func.max(AuditEventRow.id)))
    assert newest is not None
    await until("the surplus to go", lambda: removed["audit_events"] == newest - 300)
    assert await _events(world, "test.many") == 300
    assert await _events(world, "test.new") == 0, "the oldest go first"
    assert 0 < largest <= 20, "in small steps"


async def test_old_and_surplus_alerts_go(world: TowerWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    async def write(first: int, count: int, *, days_ago: float, is_open: bool = False) -> None:
        at = world.clock() - timedelta(days=days_ago)
        async with world.database.writing() as session:
            for number in range(first, first + count):
                facts = {"rule": "gps", "subject": "", "severity": "warning", "badge": "x", "words": "x"}
                row = AlertRow(id=number, drone_id=1, about_stranger=False, opened_at=at, **facts)
                row.closed_at = None if is_open else at
                session.add(row)

    async def left() -> int:
        async with world.database.reading() as session:
            return int(await session.scalar(select(func.count()).select_from(AlertRow)) or 0)

    removed = world.tower.retention.removed
    await write(0, 5, days_ago=9)
    await write(100, 30, days_ago=11)
    await write(200, 1, days_ago=50, is_open=True)
    await until("the old ones to go", lambda: removed["alerts"] == 30)
    assert await left() == 6, "one that lasts stays"
    monkeypatch.setattr(retention, "MAX_ALERTS", 20)
    await write(300, 20, days_ago=1)
    await until("the surplus to go", lambda: removed["alerts"] == 36)
    assert await left() == 20


async def test_old_files_go(world: TowerWorld) -> None:
    drone = await world.add_drone("Kestrel")
    folder = world.settings.files / f"drone-{drone.id}"
    folder.mkdir(parents=True)
    for number in range(7):
        log = folder / f"{number}-1767225600.bin"
        log.write_bytes(b"x")
        received = world.clock().timestamp() - (11 if number < 5 else 9) * DAY_S
        os.utime(log, (received, received))
    (folder / "arriving-1.part").write_bytes(b"x")
    os.utime(folder / "arriving-1.part", (0, 0))
    removed = world.tower.retention.removed
    await until("the old logs to go", lambda: removed["flight_logs"] == 5)
    assert sorted(path.name for path in folder.iterdir()) == [
        "5-1767225600.bin",
        "6-1767225600.bin",
        "arriving-1.part",
    ]
    store = world.tower.recordings.store
    for number, (state, days) in enumerate((("ready", 11), ("ready", 9), ("recording", 11))):
        name = f"{number:016x}"
        path = store.path(drone.id, name, ".mp4")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x")
        async with world.database.writing() as session:
            began_at = world.clock() - timedelta(days=days)
            words = {"by_name": "Ann", "quality": "high", "codec": "h264"}
            session.add(
                RecordingRow(drone_id=drone.id, store=store.id, file=name, state=state, began_at=began_at, **words)
            )
    await until("the old recording to go", lambda: removed["recordings"] == 1)
    async with world.database.reading() as session:
        left = (await session.scalars(select(RecordingRow.file).order_by(RecordingRow.id))).all()
    assert left == [f"{1:016x}", f"{2:016x}"]
    assert not store.path(drone.id, f"{0:016x}", ".mp4").exists()
    assert store.path(drone.id, f"{1:016x}", ".mp4").exists()
