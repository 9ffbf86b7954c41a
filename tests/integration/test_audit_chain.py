"""The audit trail as a chain of hashes: whoever changes, removes or adds an event is found, and retention is not."""

import asyncio
import shutil
from collections.abc import AsyncIterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from sqlalchemy import delete, func, select, text, update

from server.audit.store import sealer as sealing
from server.audit.store.chain import BEGINNING, canonical, event_hash
from server.audit.store.chain_tables import AuditChainRow, AuditChainStateRow, AuditHeadRow, AuditStubRow
from server.audit.store.pruning import prune
from server.audit.store.sealer import AuditSealer
from server.audit.store.tables import AuditEventRow
from server.audit.store.trail import Actor, record
from server.audit.store.verifying import Verdict, verify
from server.storage.database import Database, open_database
from server.storage.schema import migrate
from wire.drone_key import key_text, public_half

AT = datetime(2026, 11, 25, 12, 0, 0, 123456, tzinfo=UTC)
EVENTS = 50


class Key:
    def __init__(self) -> None:
        self._private = Ed25519PrivateKey.generate()
        self.public_key = public_half(self._private)

    def sign(self, message: bytes) -> bytes:
        return self._private.sign(message)

    @property
    def text(self) -> str:
        return key_text(self.public_key)


class Trail:
    """A trail with a sealer, and clocks."""

    def __init__(self, database: Database) -> None:
        self.database = database
        self.now, self.seconds = AT, 0.0
        self.key = Key()
        self.sealer = self.another_sealer()

    def another_sealer(self) -> AuditSealer:
        return AuditSealer(self.database, lambda: self.now, self.key, lambda: self.seconds)

    async def write(self, count: int = EVENTS) -> None:
        async with self.database.writing() as session:
            for number in range(count):
                detail = {"ß": number, "height_m": 20.5, "list": [None, True]}
                actor = Actor(None, f"Ann {number % 3}")
                record(session, at=self.now, actor=actor, action="test.done", drone_id=7, detail=detail)

    async def seal(self, after_s: float = 5.0) -> None:
        self.seconds += after_s
        self.now += timedelta(seconds=after_s)
        await self.sealer.once()

    async def settle(self) -> None:
        """Until no transaction can add an older event."""
        await self.seal()
        await self.seal(sealing.LATE_S + 1.0)

    async def verdict(self, *keys: str) -> Verdict:
        return await verify(self.database, keys or [self.key.text])

    async def do(self, statement: Any) -> None:
        async with self.database.writing() as session:
            await session.execute(statement)

    async def ids(self) -> list[int]:
        async with self.database.reading() as session:
            return list((await session.scalars(select(AuditEventRow.id).order_by(AuditEventRow.id))).all())


def _address(path: Path) -> str:
    return f"sqlite+aiosqlite:///{path}"


@pytest.fixture(scope="module")
def migrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty database, made once."""
    path = tmp_path_factory.mktemp("audit-chain") / "empty.db"

    async def make() -> None:
        database = open_database(_address(path))
        await migrate(database)
        await database.close()

    asyncio.run(make())
    return path


@pytest.fixture
async def database(migrated: Path, tmp_path: Path) -> AsyncIterator[Database]:
    shutil.copyfile(migrated, tmp_path / "tower.db")
    opened = open_database(_address(tmp_path / "tower.db"))
    try:
        yield opened
    finally:
        await opened.close()


@pytest.fixture
async def trail(database: Database) -> Trail:
    made = Trail(database)
    await made.write()
    await made.settle()
    return made


async def test_an_untouched_trail_is_whole(trail: Trail) -> None:
    assert await trail.verdict() == Verdict("", events=EVENTS, heads=1)
    await trail.write(3)
    assert (await trail.verdict()).waiting == 3
    await trail.seal()
    assert await trail.verdict() == Verdict("", events=EVENTS + 3, heads=1)


@pytest.mark.parametrize(
    "change",
    [
        {"actor_name": "Bob"},
        {"action": "test.undone"},
        {"drone_id": 8},
        {"address": "192.0.2.1"},
        {"at": AT + timedelta(microseconds=1)},
        {"detail": {"ß": 1}},
        {"request_id": "r"},
    ],
)
async def test_a_changed_event_is_named(trail: Trail, change: dict[str, Any]) -> None:
    wanted = (await trail.ids())[20]
    await trail.do(update(AuditEventRow).where(AuditEventRow.id.in_([wanted, wanted + 5])).values(**change))
    verdict = await trail.verdict()
    assert verdict.wrong.startswith(f"event {wanted} was changed")
    assert verdict.events == 20


async def test_an_account_that_goes_changes_nothing(trail: Trail) -> None:
    await trail.do(text("UPDATE audit_events SET actor_id = NULL"))
    assert not (await trail.verdict()).wrong


async def test_a_removed_event_is_named(trail: Trail) -> None:
    wanted = (await trail.ids())[20]
    await trail.do(delete(AuditEventRow).where(AuditEventRow.id == wanted))
    assert (await trail.verdict()).wrong.startswith(f"event {wanted} was removed")
    await trail.do(delete(AuditChainRow).where(AuditChainRow.event_id == wanted))
    assert (await trail.verdict()).wrong.startswith(f"1 event was removed before event {wanted + 1}")


async def test_an_end_that_was_cut_off_is_found(trail: Trail) -> None:
    ids = await trail.ids()
    for table, column in ((AuditEventRow, AuditEventRow.id), (AuditChainRow, AuditChainRow.event_id)):
        await trail.do(delete(table).where(column > ids[30]))
    assert "after number 31 of the chain were removed" in (await trail.verdict()).wrong or (
        "from number 32 on were removed" in (await trail.verdict()).wrong
    )
    async with trail.database.writing() as session:
        row = await session.scalar(select(AuditChainRow).where(AuditChainRow.number == 31))
        state = await session.get(AuditChainStateRow, 1)
        assert row is not None and state is not None
        state.number, state.hash = 31, row.hash
    assert "from number 32 on were removed: the head" in (await trail.verdict()).wrong, "the signed head knows"


async def test_an_event_that_was_slipped_in_is_named(trail: Trail) -> None:
    wanted = (await trail.ids())[20]
    await trail.do(delete(AuditEventRow).where(AuditEventRow.id == wanted))
    await trail.do(delete(AuditChainRow).where(AuditChainRow.event_id == wanted))
    rows = "(id, at, actor_name, action, detail, address, request_id)"
    values = f"({wanted}, '2026-11-25 12:00:00.000000', 'Bob', 'test.done', '{{}}', '', '')"
    await trail.do(text(f"INSERT INTO audit_events {rows} VALUES {values}"))
    await trail.seal()
    assert "removed before event" in (await trail.verdict()).wrong
    for table in ("audit_events", "audit_chain"):
        await trail.do(text(f"DELETE FROM {table}"))
    await trail.do(text("DELETE FROM audit_heads"))
    await trail.do(update(AuditChainStateRow).values(number=0, hash=BEGINNING))
    await trail.do(text(f"INSERT INTO audit_events {rows} VALUES {values}"))
    await trail.seal()
    assert (await trail.verdict()).wrong == f"event {wanted} was added: the chain had passed its place"


async def test_a_chain_made_anew_does_not_fit_its_head(trail: Trail) -> None:
    await trail.do(update(AuditEventRow).where(AuditEventRow.id == 10).values(actor_name="Bob"))
    async with trail.database.writing() as session:
        before = BEGINNING
        for row in (await session.scalars(select(AuditChainRow).order_by(AuditChainRow.number))).all():
            event = await session.get(AuditEventRow, row.event_id)
            assert event is not None
            row.previous, row.hash = before, event_hash(row.number, before, event)
            before = row.hash
        state = await session.get(AuditChainStateRow, 1)
        assert state is not None
        state.hash = before
    assert "signed over another chain" in (await trail.verdict()).wrong
    other = Key()
    await trail.do(update(AuditHeadRow).values(key=other.text))
    assert "not this tower's" in (await trail.verdict()).wrong
    assert "signature" in (await trail.verdict(trail.key.text, other.text)).wrong


async def test_a_head_is_signed_once_a_day(trail: Trail) -> None:
    for _ in range(30):
        await trail.write(1)
        await trail.seal(3600.0)
    verdict = await trail.verdict()
    assert (verdict.wrong, verdict.heads) == ("", 2)
    assert (await verify(trail.database, [Key().text])).wrong


async def test_retention_leaves_one_signed_stub(trail: Trail) -> None:
    ids = await trail.ids()
    for chosen in (ids[:10], ids[20:25], ids[10:20]):
        async with trail.database.writing() as session:
            assert await prune(session, chosen, trail.key, trail.now) == len(chosen)
        assert not (await trail.verdict()).wrong
    verdict = await trail.verdict()
    assert (verdict.events, verdict.removed) == (EVENTS - 25, 25)
    async with trail.database.reading() as session:
        (stub,) = (await session.scalars(select(AuditStubRow))).all()
    assert (stub.first, stub.last) == (1, 25)
    await trail.do(update(AuditStubRow).values(last=24))
    assert "signature" in (await trail.verdict()).wrong
    await trail.do(text("DELETE FROM audit_stubs"))
    assert "25 events were removed" in (await trail.verdict()).wrong


async def test_a_trail_that_retention_emptied_is_whole(trail: Trail) -> None:
    async with trail.database.writing() as session:
        await prune(session, await trail.ids(), trail.key, trail.now)
    assert await trail.verdict() == Verdict("", removed=EVENTS, heads=1)
    await trail.write(2)
    await trail.seal()
    assert await trail.verdict() == Verdict("", events=2, removed=EVENTS, heads=1)


async def test_what_is_not_in_the_chain_yet_is_not_removed(trail: Trail) -> None:
    await trail.write(2)
    async with trail.database.writing() as session:
        assert await prune(session, (await trail.ids())[-2:], trail.key, trail.now) == 0
    assert len(await trail.ids()) == EVENTS + 2


async def test_an_old_trail_gets_its_chain_in_steps(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sealing, "AT_ONCE", 20)
    monkeypatch.setattr(sealing, "MAX_IN_FLIGHT", 10)
    monkeypatch.setattr(sealing, "PAUSE_S", 0.0)
    trail = Trail(database)
    await trail.write(105)
    await trail.seal()
    assert await trail.verdict() == Verdict("", events=105, heads=1)
    async with database.reading() as session:
        state = await session.get(AuditChainStateRow, 1)
    assert state is not None and state.final_id == 90


def test_the_bytes_that_are_hashed_stay_what_they_are() -> None:
    event = AuditEventRow(
        id=3,
        at=AT,
        actor_name="Ann",
        action="a.b",
        drone_id=None,
        detail={"b": 1.5, "a": "ä"},
        address="::1",
        request_id="",
    )
    zeros = "0" * 64
    assert canonical(2, BEGINNING, event).decode() == (
        f"control-tower audit event v1\n2\n{zeros}\n3\n2026-11-25T12:00:00.123456Z\n"
        '"Ann"\n"a.b"\nnull\n{"a":"ä","b":1.5}\n"::1"\n""\n'
    )


async def test_several_towers_on_postgresql_make_one_chain(postgres_url: str) -> None:
    database = open_database(postgres_url.replace("postgresql://", "postgresql+asyncpg://"))
    try:
        await migrate(database)
        trail = Trail(database)
        others = [trail.another_sealer() for _ in range(3)]

        async def seals(sealer: AuditSealer) -> None:
            for _ in range(10):
                await sealer.once()

        late = database.writing()
        session = await late.__aenter__()
        record(session, at=trail.now, actor=Actor(None, "Late"), action="test.late")
        await session.flush()
        await asyncio.gather(*(trail.write(20) for _ in range(5)), *(seals(one) for one in others))
        await late.__aexit__(None, None, None)
        await trail.seal()
        verdict = await trail.verdict()
        assert (verdict.wrong, verdict.events, verdict.waiting) == ("", 101, 0)
        async with database.reading() as reading:
            latest = await reading.scalar(select(func.max(AuditChainRow.number)))
            first = await reading.scalar(select(func.min(AuditEventRow.id)))
            row = await reading.scalar(select(AuditChainRow).where(AuditChainRow.event_id == first))
        assert latest == 101
        assert row is not None and row.number > 1, "the transaction that ended last comes later"
    finally:
        await database.close()
