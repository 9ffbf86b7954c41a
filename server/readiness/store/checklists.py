"""Reads and writes own lines of the preflight checklist. The caller checks the right to change them."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.action import AuditAction
from server.readiness.store.checklist_tables import ChecklistRow
from wire.ids import DroneId


def scope_of_kind(kind: str) -> str:
    return f"kind:{kind}"


def scope_of_drone(drone_id: DroneId) -> str:
    return f"drone:{drone_id}"


async def read_lines(session: AsyncSession, scopes: Sequence[str]) -> dict[str, list[str]]:
    """Returns the lines by scope; a scope without lines is missing."""
    rows = await session.scalars(select(ChecklistRow).where(ChecklistRow.scope.in_(scopes)))
    return {row.scope: row.lines for row in rows}


async def keep_lines(
    session: AsyncSession, scope: str, lines: Sequence[str], *, drone_id: DroneId | None, action: AuditAction
) -> None:
    """Replaces the lines of one scope; none deletes them. In `Database.writing()`."""
    row = await session.get(ChecklistRow, scope)
    before = [] if row is None else row.lines
    if list(lines) == before:
        return
    if row is not None and not lines:
        await session.delete(row)
    elif row is not None:
        row.lines, row.changed_at, row.changed_by = list(lines), action.at, action.by.name[:64]
    else:
        session.add(
            ChecklistRow(
                scope=scope,
                drone_id=drone_id,
                lines=list(lines),
                changed_at=action.at,
                changed_by=action.by.name[:64],
            )
        )
    action.record(session, "checklist.changed", drone_id=drone_id, scope=scope, before=before, lines=list(lines))
