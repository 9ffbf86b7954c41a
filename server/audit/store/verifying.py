"""Checks the audit trail against its chain of hashes, and names the first event that does not fit.

An event that was changed has another hash. One that was removed is missing where the chain has a row for it, or leaves
a hole in the numbers. One that was added has no row, though the chain has passed its id. Whoever makes the whole chain
anew cannot sign its heads.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Collection
from dataclasses import dataclass
from typing import Final

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from sqlalchemy import select

from server.audit.store.chain import BEGINNING, Run, event_hash, head_text, stub_text
from server.audit.store.chain_tables import AuditChainRow, AuditChainStateRow, AuditHeadRow, AuditStubRow
from server.audit.store.tables import AuditEventRow
from server.storage.database import Database, DatabaseSession
from wire.drone_key import key_bytes

AT_ONCE: Final = 2000


@dataclass(frozen=True)
class Verdict:
    """`wrong`: the first thing that does not fit, in words; empty: all is well. `events`, `removed`, `heads`: how many
    fit. `waiting`: events that are not in the chain yet."""

    wrong: str = ""
    events: int = 0
    removed: int = 0
    heads: int = 0
    waiting: int = 0


class _Wrong(Exception):
    """The message is for people."""


async def verify(database: Database, keys: Collection[str]) -> Verdict:
    """`keys`: public keys of this tower that may have signed, as text. Raises DatabaseUnavailable."""
    async with database.reading() as session:
        checked = _Checked(session, keys)
        try:
            await checked.all()
        except _Wrong as wrong:
            return Verdict(str(wrong), checked.events, checked.removed, checked.heads)
        return Verdict("", checked.events, checked.removed, checked.heads, checked.waiting)


class _Checked:
    """Follows the chain from its beginning."""

    def __init__(self, session: DatabaseSession, keys: Collection[str]) -> None:
        self._session = session
        self._keys = frozenset(keys)
        self._number = 0
        self._hash = BEGINNING
        self.events = self.removed = self.heads = self.waiting = 0

    async def all(self) -> None:
        heads = {row.number: row for row in await self._session.scalars(select(AuditHeadRow))}
        stubs = {row.first: row for row in await self._session.scalars(select(AuditStubRow))}
        async for row, event in self._rows():
            while (stub := stubs.pop(self._number + 1, None)) is not None:
                self._stub(stub)
                self._head(heads.pop(self._number, None))
            self._link(row, event)
            self._head(heads.pop(self._number, None))
        while (stub := stubs.pop(self._number + 1, None)) is not None:
            self._stub(stub)
            self._head(heads.pop(self._number, None))
        if stubs:
            raise _Wrong(f"events up to number {min(stubs) - 1} of the chain were removed")
        self._covered(heads)
        await self._end()

    async def _rows(self) -> AsyncIterator[tuple[AuditChainRow, AuditEventRow | None]]:
        after = 0
        while True:
            query = (
                select(AuditChainRow, AuditEventRow)
                .outerjoin(AuditEventRow, AuditEventRow.id == AuditChainRow.event_id)
                .where(AuditChainRow.number > after)
                .order_by(AuditChainRow.number)
                .limit(AT_ONCE)
            )
            rows = (await self._session.execute(query)).all()
            for row, event in rows:
                yield row, event
            if len(rows) < AT_ONCE:
                return
            after = rows[-1][0].number
            self._session.expunge_all()

    def _link(self, row: AuditChainRow, event: AuditEventRow | None) -> None:
        if row.number != self._number + 1:
            missing = row.number - self._number - 1
            what = "1 event was removed" if missing == 1 else f"{missing} events were removed"
            raise _Wrong(f"{what} before event {row.event_id}: number {self._number + 1} of the chain is missing")
        if event is None:
            raise _Wrong(f"event {row.event_id} was removed (number {row.number} of the chain)")
        if row.previous != self._hash or row.hash != event_hash(row.number, row.previous, event):
            at = f"{event.at:%Y-%m-%d %H:%M:%S} UTC"
            raise _Wrong(f"event {event.id} was changed ({at}, {event.action}, number {row.number} of the chain)")
        self._number, self._hash = row.number, row.hash
        self.events += 1

    def _stub(self, stub: AuditStubRow) -> None:
        run = Run(stub.first, stub.last, stub.previous, stub.hash)
        name = f"the stub of numbers {stub.first} to {stub.last}"
        self._signed(stub.key, stub.signature, stub_text(run, stub.at), name)
        if stub.previous != self._hash or stub.last < stub.first:
            raise _Wrong(f"{name} does not follow what is before it")
        self._number, self._hash = stub.last, stub.hash
        self.removed += stub.last - stub.first + 1

    def _head(self, head: AuditHeadRow | None) -> None:
        if head is None:
            return
        name = f"the head of {head.at:%Y-%m-%d %H:%M:%S} UTC (number {head.number})"
        self._signed(head.key, head.signature, head_text(head.number, head.hash, head.at), name)
        if head.hash != self._hash:
            raise _Wrong(f"{name} was signed over another chain: events up to there were made anew")
        self.heads += 1

    def _covered(self, heads: dict[int, AuditHeadRow]) -> None:
        """Heads that were not met: of events that have a stub by now, or of a chain that was longer."""
        for number, head in sorted(heads.items()):
            name = f"the head of {head.at:%Y-%m-%d %H:%M:%S} UTC (number {number})"
            self._signed(head.key, head.signature, head_text(number, head.hash, head.at), name)
            if number > self._number:
                raise _Wrong(f"events from number {self._number + 1} on were removed: {name} proves that they existed")
            self.heads += 1

    def _signed(self, key: str, signature: bytes, text: bytes, name: str) -> None:
        if key not in self._keys:
            raise _Wrong(f"{name} is signed by a key that is not this tower's: {key}")
        try:
            Ed25519PublicKey.from_public_bytes(key_bytes(key)).verify(signature, text)
        except (InvalidSignature, ValueError):
            raise _Wrong(f"the signature of {name} is wrong") from None

    async def _end(self) -> None:
        state = await self._session.get(AuditChainStateRow, 1)
        if state is None:
            if self._number:
                raise _Wrong("the state of the chain was removed")
            final_id = 0
        else:
            if (state.number, state.hash) != (self._number, self._hash):
                raise _Wrong(f"events after number {self._number} of the chain were removed: it had {state.number}")
            final_id = state.final_id
        chained = select(AuditChainRow.event_id).where(AuditChainRow.event_id == AuditEventRow.id)
        query = select(AuditEventRow.id).where(~chained.exists()).order_by(AuditEventRow.id)
        for event_id in await self._session.scalars(query):
            if event_id <= final_id:
                raise _Wrong(f"event {event_id} was added: the chain had passed its place")
            self.waiting += 1
