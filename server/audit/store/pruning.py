"""Removes audit events that retention lets go, and leaves a signed stub in the chain in their place."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from datetime import datetime

from sqlalchemy import delete, select

from server.audit.store.chain import Run, stub_text
from server.audit.store.chain_tables import AuditChainRow, AuditStubRow
from server.audit.store.sealer import Signer, chain_state
from server.audit.store.tables import AuditEventRow
from server.storage.database import DatabaseSession
from wire.drone_key import key_text


async def prune(session: DatabaseSession, event_ids: Collection[int], key: Signer, at: datetime) -> int:
    """Removes those events that are in the chain; the others have to wait for it. Returns how many."""
    if not event_ids:
        return 0
    await chain_state(session)
    query = select(AuditChainRow).where(AuditChainRow.event_id.in_(event_ids)).order_by(AuditChainRow.number)
    rows = (await session.scalars(query)).all()
    for run in _runs(rows):
        await _leave_stub(session, run, key, at)
    numbers, ids = [row.number for row in rows], [row.event_id for row in rows]
    if rows:
        await session.execute(delete(AuditChainRow).where(AuditChainRow.number.in_(numbers)))
        await session.execute(delete(AuditEventRow).where(AuditEventRow.id.in_(ids)))
    return len(rows)


def _runs(rows: Iterable[AuditChainRow]) -> Iterator[Run]:
    """Rows in a row, together."""
    run: Run | None = None
    for row in rows:
        if run is not None and row.number == run.last + 1:
            run = Run(run.first, row.number, run.previous, row.hash)
            continue
        if run is not None:
            yield run
        run = Run(row.number, row.number, row.previous, row.hash)
    if run is not None:
        yield run


async def _leave_stub(session: DatabaseSession, run: Run, key: Signer, at: datetime) -> None:
    """Joins it with its neighbours: usually there is one stub, which grows."""
    before = await session.scalar(select(AuditStubRow).where(AuditStubRow.last == run.first - 1))
    after = await session.get(AuditStubRow, run.last + 1)
    neighbours: Sequence[AuditStubRow | None] = (before, after)
    if before is not None:
        run = Run(before.first, run.last, before.previous, run.hash)
    if after is not None:
        run = Run(run.first, after.last, run.previous, after.hash)
    for one in neighbours:
        if one is not None:
            await session.delete(one)
    await session.flush()
    session.add(
        AuditStubRow(
            first=run.first,
            last=run.last,
            previous=run.previous,
            hash=run.hash,
            at=at,
            key=key_text(key.public_key),
            signature=key.sign(stub_text(run, at)),
        )
    )
    await session.flush()
