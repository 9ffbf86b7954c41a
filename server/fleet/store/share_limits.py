"""The limits of shares that admins have chosen. The fleet's snapshot carries them to every tower."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.action import AuditAction
from server.fleet.store.snapshot import begin_fleet_change
from server.fleet.store.tables import ShareLimitRow
from server.kernel.shares import SHARES, ShareName, check_limit


async def change_limit(
    session: AsyncSession, name: ShareName, limit: int | None, *, default: int, action: AuditAction
) -> None:
    """`limit` None: back to `default`, the tower's. In `Database.writing()`. Raises BadShareLimit."""
    share = SHARES[name]
    check_limit(share, limit)
    await begin_fleet_change(session)
    row = await session.get(ShareLimitRow, name.value)
    before = default if row is None else row.value
    if limit is None or limit == default:
        if row is not None:
            await session.delete(row)
    elif row is None:
        session.add(ShareLimitRow(name=name.value, value=limit, changed_by=action.by.name, changed_at=action.at))
    else:
        row.value, row.changed_by, row.changed_at = limit, action.by.name, action.at
    after = default if limit is None else limit
    if after != before:
        action.record(session, "share.changed", share=name.value, limit=after, before=before)


async def chosen_limits(session: AsyncSession) -> list[ShareLimitRow]:
    return list(await session.scalars(select(ShareLimitRow)))
