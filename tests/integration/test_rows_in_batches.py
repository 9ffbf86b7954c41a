"""Gaps, flights and alerts that begin together get their rows together: a tower must not spend itself on them."""

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from sqlalchemy import event, select
from tower_world import copy_empty_database

from server.accounts.store.tables import UserRow
from server.alerts.core.alert import Alert
from server.alerts.core.announcer import Announcement, Happening
from server.alerts.core.rules import BY_NAME
from server.alerts.store.channels import outbox
from server.alerts.store.channels.tables import AlertChannelRow
from server.alerts.store.tables import AlertRow
from server.alerts.store.writer import AlertWriter
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.fleet.store.drones import create_drone
from server.flights.core.black_box import BlackBoxFetcher
from server.flights.core.gap_watch import GapFound, GapWatch
from server.flights.core.recorder import FlightHead
from server.flights.store.files import FlightFiles
from server.flights.store.gaps import FOUND_AT_ONCE, GapService
from server.flights.store.quota import FlightQuota
from server.flights.store.service import FlightService
from server.flights.store.tables import FlightGapRow, FlightRow
from server.flights.store.writer import FlightFile, FlightWriter
from server.kernel.shares import ShareName, Shares
from server.storage.database import Database, DatabaseUnavailable, open_database
from wire.ids import DroneId

NOW = datetime(2026, 7, 1, 12, 0, tzinfo=UTC)
DRONES = 30


class Store:
    """A database with drones, flights of all of them that are being recorded, and what was asked of the database."""

    def __init__(self, database: Database, folder: Path) -> None:
        self.database = database
        self.asked: list[str] = []
        files = FlightFiles(folder / "flights")
        files.open()
        writer = FlightWriter()
        quota = FlightQuota(
            database=database, clock=lambda: NOW, files=files, budget_bytes=1_000_000, accounts=lambda: cast(Any, {})
        )
        self.flights = FlightService(
            database=database, clock=lambda: NOW, files=files, writer=writer, quota=quota, largest_bytes=1_000_000
        )
        self.watch = GapWatch()
        self.fetched: list[Any] = []
        fetcher = cast(BlackBoxFetcher, SimpleNamespace(add=self.fetched.append))
        self.gaps = GapService(database=database, clock=lambda: NOW, files=files, watch=self.watch, fetcher=fetcher)
        event.listen(database.engine.sync_engine, "before_cursor_execute", self._note)

    def _note(self, _connection: Any, _cursor: Any, statement: str, *_more: Any) -> None:
        self.asked.append(statement.split()[0])

    async def begin_flights(self) -> list[FlightFile]:
        heads = [FlightHead(DroneId(number), f"Drone {number}", NOW, None, 0.0) for number in range(1, DRONES + 1)]
        sinks = [self.flights.begin(head) for head in heads]
        return [one for one in sinks if isinstance(one, FlightFile)]

    async def rows(self, table: Any) -> list[Any]:
        async with self.database.reading() as session:
            return list((await session.scalars(select(table).order_by(table.id))).all())


@pytest.fixture
async def store(tmp_path: Path) -> AsyncIterator[Store]:
    copy_empty_database(tmp_path / "tower.sqlite3")
    database = open_database(f"sqlite+aiosqlite:///{tmp_path / 'tower.sqlite3'}")
    async with database.writing() as session:
        for number in range(DRONES):
            await create_drone(session, name=f"Drone {number}", action=AuditAction(by=COMMAND_LINE, at=NOW))
    yield Store(database, tmp_path)
    await database.close()


async def test_flights_that_begin_together_have_their_rows_with_few_statements(store: Store) -> None:
    sinks = await store.begin_flights()
    store.asked.clear()
    await store.flights._insert(list(store.flights._new))
    assert {row.file for row in await store.rows(FlightRow)} == {one.file for one in sinks}
    assert store.asked.count("DELETE") == 0
    assert len(store.asked) <= DRONES + 6, "one for each flight, and a few for all"


async def test_gaps_that_are_found_together_have_their_rows_together(store: Store) -> None:
    sinks = await store.begin_flights()
    found = [GapFound(DroneId(one.drone_id), one, 1_000 + number, 2_000) for number, one in enumerate(sinks)]
    for one in found:
        store.watch.on_gap(one)
    await store.gaps._step()
    assert await store.rows(FlightGapRow) == [], "no flight has a row yet: they wait"
    assert list(store.gaps._jobs) == found

    await store.flights._insert(list(store.flights._new)[: DRONES - 1])
    before = store.database.answers.transactions
    sinks[-1].closed = True  # its row never came: its drone was deleted
    store.watch.on_gap(GapFound(DroneId(1), sinks[0], 5_000, 6_000))
    await store.gaps._step()
    assert not store.gaps._jobs
    assert store.database.answers.transactions - before == 1
    rows = await store.rows(FlightGapRow)
    assert [row.from_us for row in rows] == [*range(1_000, 1_000 + DRONES - 1), 5_000]
    files = {row.id: row.file for row in await store.rows(FlightRow)}
    of_rows = [(row.id, files[row.flight_id], row.from_us, row.to_us) for row in rows]
    assert of_rows == [(gap.id, gap.file, gap.from_us, gap.to_us) for gap in store.fetched]


async def test_more_gaps_than_one_transaction_takes_are_all_stored(store: Store) -> None:
    (first, *_) = await store.begin_flights()
    await store.flights._insert(list(store.flights._new))
    many = 2 * FOUND_AT_ONCE + 5
    for number in range(many):
        store.watch.on_gap(GapFound(DroneId(1), first, number, number + 1))
    before = store.database.answers.transactions
    await store.gaps._step()
    assert store.database.answers.transactions - before <= 4, "three, and the look for what is to be merged"
    assert [row.from_us for row in await store.rows(FlightGapRow)] == list(range(many))


async def test_gaps_outlast_a_database_that_is_away(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    sinks = await store.begin_flights()
    await store.flights._insert(list(store.flights._new))
    found = [GapFound(DroneId(one.drone_id), one, 1, 2) for one in sinks]
    for one in found:
        store.watch.on_gap(one)

    def away() -> Any:
        raise DatabaseUnavailable("away")

    with monkeypatch.context() as patched:
        patched.setattr(store.database, "writing", away)
        with pytest.raises(DatabaseUnavailable):
            await store.gaps._step()
    assert list(store.gaps._jobs) == found and store.fetched == []
    await store.gaps._step()
    assert len(await store.rows(FlightGapRow)) == len(store.fetched) == DRONES


def alert(number: int, words: str = "found", drone_id: int = 1) -> Alert:
    return Alert(number, BY_NAME["unattended"], "", DroneId(drone_id), words, NOW)


async def test_new_alerts_and_known_ones_are_stored_together(store: Store) -> None:
    alerts = AlertWriter(store.database, lambda: NOW)
    known = [alert(number) for number in range(1, 21)]
    for one in known:
        alerts.changed(one)
    await alerts._write_all()
    for one in known[:10]:
        one.closed_at = NOW
        alerts.changed(one)
    for number in range(21, 41):
        alerts.changed(alert(number))
    store.asked.clear()
    await alerts._write_all()
    assert alerts.waiting() == []
    assert store.asked.count("SELECT") == 1
    rows = await store.rows(AlertRow)
    assert [row.id for row in rows] == list(range(1, 41))
    assert [row.closed_at is not None for row in rows] == [True] * 10 + [False] * 30


async def test_alerts_that_find_no_room_are_counted(store: Store) -> None:
    shares = Shares()
    shares.apply({ShareName.ALERTS: 5})
    alerts = AlertWriter(store.database, lambda: NOW, shares)
    for number in range(1, 8):
        alerts.changed(alert(number))
    alerts.changed(alert(5))
    alerts.changed(alert(8, drone_id=2))
    assert alerts.lost == 2, "one that waits already needs no room, and the other drone has a share of its own"
    await alerts._write_all()
    assert [row.id for row in await store.rows(AlertRow)] == [1, 2, 3, 4, 5, 8]
    alerts.changed(alert(9))
    assert alerts.lost == 2
    await alerts._write_all()


async def test_what_waits_about_one_drone_leaves_room_for_the_others(store: Store) -> None:
    async with store.database.writing() as session:
        someone = UserRow(name="ada", name_key="ada", password_hash="", role="admin", created_at=NOW)
        session.add(someone)
        await session.flush()
        channel = AlertChannelRow(
            user_id=someone.id, kind="mail", target="a@example.org", severity="notice", drones="all", created_at=NOW
        )
        session.add(channel)
    alerts = AlertWriter(store.database, lambda: NOW)

    async def announced(numbers: range, drone_id: int) -> int:
        known = [alert(number, drone_id=drone_id) for number in numbers]
        for one in known:
            alerts.changed(one)
        await alerts._write_all()
        said = [(Announcement(Happening.OPENED, one, "Kestrel"), {"id": one.id}) for one in known]
        async with store.database.writing() as session:
            return await outbox.put(session, said, knows=lambda *_: True, owns=lambda *_: True, now=NOW, of_a_drone=5)

    assert await announced(range(1, 9), 1) == 3
    assert await announced(range(9, 12), 1) == 3
    assert await announced(range(20, 24), 2) == 0
