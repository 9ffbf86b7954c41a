"""`/api/v1/audit`: reading the audit trail, for admins."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, Field
from sqlalchemy import select

from server.access import Admin, AdminsOnly, NotSignedIn, SessionExpired
from server.audit.tables import AuditEventRow
from server.problem_docs import answers
from server.tower import tower_of

router = APIRouter(prefix="/api/v1/audit", tags=["audit"])


class AuditEventView(BaseModel):
    id: int
    at: datetime
    actor_id: Annotated[int | None, Field(description="null: nobody signed in, the command line, or deleted since")]
    actor_name: str
    action: str
    drone_id: int | None
    detail: dict[str, Any]
    address: str


@router.get("", responses=answers(NotSignedIn, SessionExpired, AdminsOnly))
async def list_audit_events(
    request: Request,
    admin: Admin,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
    before: Annotated[int | None, Query(ge=1, le=2**31 - 1, description="Only events with a smaller id")] = None,
) -> list[AuditEventView]:
    """The audit trail, newest first. For the next page, ask for what is before the last id."""
    query = select(AuditEventRow).order_by(AuditEventRow.id.desc()).limit(limit)
    if before is not None:
        query = query.where(AuditEventRow.id < before)
    async with tower_of(request).database.reading() as session:
        return [AuditEventView.model_validate(row, from_attributes=True) for row in await session.scalars(query)]
