"""Appends new audit events to the chain of hashes, in the background: no request and no frame waits for it.

- Events are written as before. Every `LOOK_EVERY_S` what has been committed gets the next numbers of the chain, in the
  order of ids.
- A transaction may commit an id that is lower than one seen before. For `LATE_S`, longer than any transaction lives,
  such ids are looked for; they get later numbers.
- Several towers on one database append one after another: each locks the row of the chain's state first.
- Once a day the tower signs the head.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from datetime import datetime, timedelta
from typing import Final, Protocol

import structlog
from sqlalchemy import func, insert, select
from sqlalchemy.exc import IntegrityError

from server.audit.store.chain import BEGINNING, event_hash, head_text
from server.audit.store.chain_tables import AuditChainRow, AuditChainStateRow, AuditHeadRow
from server.audit.store.tables import AuditEventRow
from server.kernel.clock import Clock
from server.storage.database import Database, DatabaseSession, DatabaseUnavailable
from wire.drone_key import key_text

LOOK_EVERY_S: Final = 5.0
LATE_S: Final = 60.0
AT_ONCE: Final = 100
MAX_IN_FLIGHT: Final = 5000
"""Ids that running transactions have and that are not committed yet, of all towers. So a long backlog, as after the
migration, is not searched again and again."""
PAUSE_S: Final = 0.2
"""Between two steps of a long backlog: other writers come first."""
SIGN_EVERY: Final = timedelta(days=1)
_log = structlog.get_logger(__name__)


class Signer(Protocol):
    """The tower's key."""

    public_key: bytes

    def sign(self, message: bytes) -> bytes:
        """64 bytes."""


async def chain_state(session: DatabaseSession) -> AuditChainStateRow:
    """Locked until the transaction ends."""
    row = await session.scalar(select(AuditChainStateRow).where(AuditChainStateRow.id == 1).with_for_update())
    if row is None:
        row = AuditChainStateRow(id=1, number=0, hash=BEGINNING, final_id=0)
        session.add(row)
        await session.flush()
    return row


class AuditSealer:
    """One for a tower. `sealed`: events since it started."""

    def __init__(
        self, database: Database, clock: Clock, key: Signer, monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        self._database = database
        self._clock = clock
        self._key = key
        self._monotonic = monotonic
        self._newest = database.repeated(select(func.max(AuditEventRow.id)))
        self._seen: deque[tuple[float, int]] = deque()
        """Newest ids, and when they were seen."""
        self._sealed_id = -1
        """The newest id at the last look; nothing has come since."""
        self._final = -1
        """Up to this id nothing older can come."""
        self._signed_id = -1
        """The newest id when signing was last tried: without news there is nothing to sign."""
        self._sign_at: datetime | None = None
        self.sealed = 0

    async def work(self) -> None:
        """Runs until cancelled."""
        while True:
            try:
                await self.once()
            except (DatabaseUnavailable, IntegrityError) as error:
                _log.warning("audit_not_sealed", error=type(error).__name__)
            await asyncio.sleep(LOOK_EVERY_S)

    async def once(self) -> None:
        """Seals everything that is there."""
        newest = await self._database.ask(self._newest) or 0
        now = self._monotonic()
        if not self._seen or newest > self._seen[-1][1]:
            self._seen.append((now, newest))
        if newest != self._sealed_id or self._final < newest:
            final_id = self._final_id(now)
            await self._step_by_step(final_id)
            self._sealed_id, self._final = newest, max(self._final, final_id)
        is_due = self._sign_at is None or self._clock() >= self._sign_at
        if is_due and self._signed_id != newest:
            await self._sign()
            self._signed_id = newest

    async def _step_by_step(self, final_id: int) -> None:
        sealed = AT_ONCE
        while sealed == AT_ONCE:
            sealed = await self._step(final_id)
            if sealed == AT_ONCE:
                await asyncio.sleep(PAUSE_S)

    def _final_id(self, now: float) -> int:
        """No transaction goes on that could add an event up to this id."""
        final = 0
        while self._seen and now - self._seen[0][0] > LATE_S:
            final = self._seen[0][1]
            if len(self._seen) == 1:
                break
            self._seen.popleft()
        return final

    async def _step(self, final_id: int) -> int:
        async with self._database.writing() as session:
            state = await chain_state(session)
            chained = select(AuditChainRow.event_id).where(AuditChainRow.event_id == AuditEventRow.id)
            query = select(AuditEventRow).where(AuditEventRow.id > state.final_id, ~chained.exists())
            events = (await session.scalars(query.order_by(AuditEventRow.id).limit(AT_ONCE))).all()
            rows = []
            for event in events:
                state.number += 1
                hash_ = event_hash(state.number, state.hash, event)
                rows.append(
                    {"number": state.number, "event_id": event.id, "previous": state.hash, "hash": hash_},
                )
                state.hash = hash_
            if rows:
                await session.execute(insert(AuditChainRow), rows)
            if len(events) < AT_ONCE:
                state.final_id = max(state.final_id, final_id)
            else:
                state.final_id = max(state.final_id, events[-1].id - MAX_IN_FLIGHT)
        self.sealed += len(events)
        return len(events)

    async def _sign(self) -> None:
        async with self._database.writing() as session:
            state = await chain_state(session)
            last = await session.scalar(select(AuditHeadRow).order_by(AuditHeadRow.number.desc()).limit(1))
            now = self._clock()
            if last is not None:
                self._sign_at = last.at + SIGN_EVERY
                if now < self._sign_at:
                    return
            if state.number <= (0 if last is None else last.number):
                return
            self._sign_at = now + SIGN_EVERY
            signature = self._key.sign(head_text(state.number, state.hash, now))
            key = key_text(self._key.public_key)
            session.add(AuditHeadRow(number=state.number, hash=state.hash, at=now, key=key, signature=signature))
            number = state.number
        _log.info("audit_head_signed", number=number)
