"""The audit trail with 5,000,000 events: how long each filter of the console takes, on SQLite and on PostgreSQL.

`--rows N` fills another number, `--system sqlite|postgresql` measures one of them. The databases are made anew in a
temporary folder; PostgreSQL is the machine's own program, started for this run.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import sqlite3
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import UTC, datetime, timedelta
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, Final

import asyncpg  # type: ignore[import-untyped]
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from bench.rows import Report
from server.audit.store.sealer import AuditSealer
from server.audit.store.search import AuditFilter, page
from server.audit.store.trail import Actor, record
from server.storage.database import Database, open_database
from server.storage.database_facts import database_facts
from server.storage.schema import migrate

_TESTS: Final = str(Path(__file__).resolve().parents[1] / "tests")
"""They can start a PostgreSQL."""
ROWS: Final = 5_000_000
ROUNDS: Final = 20
PAGE: Final = 100
AT_ONCE: Final = 50_000
WRITES: Final = 300
CHAIN_S: Final = 5.0
DRONES: Final = 200
BEGAN: Final = datetime(2025, 1, 1, tzinfo=UTC)
LASTED: Final = timedelta(days=730)
COLUMNS: Final = ("at", "actor_name", "action", "drone_id", "detail", "address")
PILOTS: Final = tuple(f"pilot-{number}" for number in range(40))
FREQUENT: Final = (
    ("command.given", 50),
    ("operation.began", 8),
    ("operation.ended", 8),
    ("control.acquire", 6),
    ("control.release", 5),
    ("control.take", 3),
    ("control.give", 3),
    ("hold.confirmed", 4),
    ("session.began", 6),
    ("session.ended", 4),
    ("drone.settings_changed", 2),
    ("recording.began", 1),
)
RARE: Final = ("user.created", "user.disabled", "drone.created", "drone.deleted", "token.created", "loan.made")
"""One event in 20,000 each."""
OLD: Final = "enrolment.used"
"""Only in the first tenth of the time, by `OLD_ACTOR` too."""
OLD_ACTOR: Final = "retired"


def events(count: int) -> Iterator[tuple[datetime, str, str, int | None, str, str]]:
    """The same events at every run, oldest first."""
    chance = random.Random(18)
    actions, weights = zip(*FREQUENT, strict=True)
    detail = json.dumps({"command": "MAV_CMD_NAV_TAKEOFF", "result": "accepted", "way": "operation", "height_m": 20})
    step, at = LASTED / count, BEGAN
    chosen: list[str] = []
    for number in range(count):
        if not chosen:
            chosen = chance.choices(actions, weights, k=AT_ONCE)
        action, actor = chosen.pop(), PILOTS[int(chance.random() ** 2 * len(PILOTS))]
        drone_id: int | None = 1 + int(chance.random() * DRONES)
        if number % 20_000 < len(RARE):
            action, actor, drone_id = RARE[number % 20_000], "Root", None
        elif number < count // 10 and number % 1000 == 7:
            action, actor = OLD, OLD_ACTOR
        at += step
        yield at, actor, action, drone_id, detail, "203.0.113.7"


def filters(middle: datetime) -> dict[str, AuditFilter]:
    old, week = BEGAN + LASTED / 4, timedelta(days=7)
    return {
        "no filter": AuditFilter(),
        "action, frequent": AuditFilter(action="command.given"),
        "action, rare": AuditFilter(action="drone.deleted"),
        "action, only long ago": AuditFilter(action=OLD),
        "action, none": AuditFilter(action="no.such"),
        "prefix, frequent": AuditFilter(action="control."),
        "prefix, rare": AuditFilter(action="user."),
        "prefix, only long ago": AuditFilter(action="enrolment."),
        "prefix, none": AuditFilter(action="nothing."),
        "who, frequent": AuditFilter(actor="PILOT-0"),
        "who, rare": AuditFilter(actor="root"),
        "who, only long ago": AuditFilter(actor=OLD_ACTOR),
        "who, nobody": AuditFilter(actor="nobody"),
        "drone": AuditFilter(drone_id=7),
        "drone, none": AuditFilter(drone_id=DRONES + 1),
        "since": AuditFilter(since=middle),
        "until": AuditFilter(until=old),
        "a week long ago": AuditFilter(since=old, until=old + week),
        "who and action": AuditFilter(actor="pilot-0", action="control.take"),
        "who and action, never": AuditFilter(actor="pilot-0", action="user.created"),
        "who and prefix": AuditFilter(actor="pilot-0", action="control."),
        "drone and action": AuditFilter(drone_id=7, action="control.take"),
        "drone and prefix": AuditFilter(drone_id=7, action="hold."),
        "drone and who": AuditFilter(drone_id=7, actor="pilot-30"),
        "drone and who, never": AuditFilter(drone_id=7, actor="root"),
        "action, until": AuditFilter(action="command.given", until=old),
        "prefix, until": AuditFilter(action="control.", until=old),
        "who, until": AuditFilter(actor="pilot-0", until=old),
        "drone, until": AuditFilter(drone_id=7, until=old),
        "who, a week long ago": AuditFilter(actor="pilot-0", since=old, until=old + week),
        "everything": AuditFilter(actor="pilot-0", action="control.", drone_id=7, since=old, until=middle),
    }


async def run(report: Report, options: argparse.Namespace) -> None:
    rows, rounds = options.rows or (50_000 if options.quick else ROWS), options.rounds or ROUNDS
    sys.path.insert(0, _TESTS)
    from worlds.postgres import postgres_programs, temporary_postgres  # type: ignore[import-not-found]

    for system in options.system or ("sqlite", "postgresql"):
        report.system = system
        with ExitStack() as stack, tempfile.TemporaryDirectory(prefix="bench-audit-") as folder:
            if system == "sqlite":
                file = Path(folder) / "tower.sqlite3"
                url = f"sqlite+aiosqlite:///{file}"
                await _migrated(url)
                began = time.monotonic()
                await asyncio.to_thread(_fill_sqlite, file, rows)
            else:
                programs = postgres_programs()
                if programs is None:
                    raise RuntimeError("PostgreSQL is not installed")
                address = f"{stack.enter_context(temporary_postgres(programs))}/postgres"
                url = address.replace("postgresql://", "postgresql+asyncpg://")
                await _migrated(url)
                began = time.monotonic()
                await _fill_postgres(address, rows)
            report.add("table", "rows", rows, "count")
            report.add("table", "filled_in", time.monotonic() - began, "s")
            database = open_database(url, timeout_s=60.0)
            try:
                await _measure(report, database, rounds)
            finally:
                await database.close()


async def _migrated(url: str) -> None:
    database = open_database(url)
    try:
        await migrate(database)
    finally:
        await database.close()


def _fill_sqlite(file: Path, count: int) -> None:
    marks = ", ".join("?" * len(COLUMNS))
    statement = f"INSERT INTO audit_events ({', '.join(COLUMNS)}) VALUES ({marks})"
    connection = sqlite3.connect(file)
    try:
        made = events(count)
        while some := list(islice(made, AT_ONCE)):
            connection.executemany(statement, ((f"{at:%Y-%m-%d %H:%M:%S.%f}", *rest) for at, *rest in some))
            connection.commit()
    finally:
        connection.close()


async def _fill_postgres(address: str, count: int) -> None:
    connection = await asyncpg.connect(address)
    try:
        made = events(count)
        while some := list(islice(made, AT_ONCE)):
            await connection.copy_records_to_table("audit_events", records=some, columns=COLUMNS)
        await connection.execute("ANALYZE audit_events")  # as its autovacuum does by itself
    finally:
        await connection.close()


async def _measure(report: Report, database: Database, rounds: int) -> None:
    facts = await database_facts(database)
    report.add("table", "database_size", facts.size_bytes / 1e6, "MB")
    middle = BEGAN + LASTED / 2
    slowest = 0.0
    for name, wanted in filters(middle).items():
        found = await page(database, wanted, limit=PAGE)
        took_ms = []
        for _ in range(rounds):
            began = time.perf_counter()
            await page(database, wanted, limit=PAGE)
            took_ms.append((time.perf_counter() - began) * 1000)
        report.add(name, "events_on_the_page", len(found), "count")
        report.spread(name, "page", took_ms, "ms")
        slowest = max(slowest, sorted(took_ms)[len(took_ms) // 2])
        if len(found) == PAGE:
            took_ms = await _next_pages(database, wanted, found, rounds)
            report.spread(f"{name}, next pages", "page", took_ms, "ms")
            slowest = max(slowest, sorted(took_ms)[len(took_ms) // 2])
    report.add("all filters", "slowest_median", slowest, "ms")
    report.spread("write", "one_event", await _writes(database), "ms")
    await _measure_chain(report, database)


async def _measure_chain(report: Report, database: Database) -> None:
    """Writes while the chain of hashes takes the events of years, as after the first start of this version."""
    sealer = AuditSealer(database, lambda: datetime.now(UTC), _Key())
    began = time.monotonic()
    sealing = asyncio.create_task(sealer.once())
    try:
        report.spread("write, while the chain takes old events", "one_event", await _writes(database), "ms")
        left_s = CHAIN_S - (time.monotonic() - began)
        await asyncio.wait({sealing}, timeout=max(0.0, left_s))
        report.add("chain", "old_events", sealer.sealed / (time.monotonic() - began), "1/s")
    finally:
        sealing.cancel()
        await asyncio.gather(sealing, return_exceptions=True)


class _Key:
    """Signs as the tower does."""

    def __init__(self) -> None:
        self._private = Ed25519PrivateKey.generate()
        self.public_key = self._private.public_key().public_bytes_raw()

    def sign(self, message: bytes) -> bytes:
        return self._private.sign(message)


async def _next_pages(database: Database, wanted: AuditFilter, found: Any, rounds: int) -> list[float]:
    took_ms = []
    for _ in range(rounds):
        began = time.perf_counter()
        found = await page(database, wanted, before=found[-1].id, limit=PAGE)
        took_ms.append((time.perf_counter() - began) * 1000)
        if len(found) < PAGE:
            break
        assert all(one.at >= other.at for one, other in pairwise(found))
    return took_ms


async def _writes(database: Database) -> list[float]:
    took_ms = []
    for number in range(WRITES):
        began = time.perf_counter()
        async with database.writing() as session:
            at = datetime.now(UTC)
            record(session, at=at, actor=Actor(None, PILOTS[number % 40]), action="command.given", drone_id=7)
        took_ms.append((time.perf_counter() - began) * 1000)
    return took_ms
