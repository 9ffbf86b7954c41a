"""`/api/v1/audit`: the audit trail, for admins, as JSON and as a CSV download."""

from __future__ import annotations

import csv
import json
from collections.abc import AsyncIterator
from datetime import datetime
from io import SEEK_END, StringIO
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Query
from fastapi.responses import StreamingResponse
from pydantic import AwareDatetime, BaseModel, Field

from server.audit.store.search import AuditFilter, page, pages
from server.audit.store.tables import AuditEventRow
from server.http.access import Admin
from server.http.dependencies import DatabaseDep
from server.http.problem_docs import answers
from server.kernel.access import AdminsOnly, NotSignedIn, SessionExpired
from server.storage.database import Database

router = APIRouter(prefix="/api/v1", tags=["audit"])

MAX_IN_CSV: Final = 100_000
_NO_NUL: Final = r"^[^\x00]*$"
"""Not every database can search for NUL, and no stored text contains it."""
COLUMNS: Final = ("id", "at", "actor_id", "actor_name", "action", "drone_id", "address", "request_id", "detail")


class AuditEventView(BaseModel):
    id: int
    at: datetime
    actor_id: Annotated[int | None, Field(description="null: not signed in, command line, or deleted")]
    actor_name: str
    action: str
    drone_id: int | None
    detail: dict[str, Any]
    address: str
    request_id: Annotated[str, Field(description="Of the request that caused it; empty: none did")]


async def _filter(
    action: Annotated[
        str | None,
        Query(max_length=64, pattern=_NO_NUL, description="An action, or a prefix that ends with a dot: `control.`"),
    ] = None,
    actor: Annotated[str | None, Query(max_length=64, pattern=_NO_NUL, description="A name; case-insensitive")] = None,
    drone_id: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
    since: Annotated[AwareDatetime | None, Query(description="Not before")] = None,
    until: Annotated[AwareDatetime | None, Query(description="Before")] = None,
    request_id: Annotated[str | None, Query(max_length=64, pattern=_NO_NUL, description="`X-Request-Id`")] = None,
) -> AuditFilter:
    """The search filter. An event must match all given parameters."""
    return AuditFilter(
        action=action, actor=actor, drone_id=drone_id, since=since, until=until, request_id=request_id or None
    )


Wanted = Annotated[AuditFilter, Depends(_filter)]
_ADMINS = answers(NotSignedIn, SessionExpired, AdminsOnly)


@router.get("/audit", responses=_ADMINS)
async def list_audit_events(
    admin: Admin,
    database: DatabaseDep,
    wanted: Wanted,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
    before: Annotated[int | None, Query(ge=1, le=2**31 - 1, description="Only events with a smaller id")] = None,
) -> list[AuditEventView]:
    """Lists the audit trail, newest first. For the next page, set `before` to the last id."""
    found = await page(database, wanted, before=before, limit=limit)
    return [AuditEventView.model_validate(row, from_attributes=True) for row in found]


@router.get(
    "/audit.csv",
    responses=_ADMINS | {200: {"content": {"text/csv": {"schema": {"type": "string"}}}}},
    response_class=StreamingResponse,
)
async def download_audit_events(admin: Admin, database: DatabaseDep, wanted: Wanted) -> StreamingResponse:
    """Returns the same as a CSV file, newest first, at most 100,000 events."""
    headers = {"Content-Disposition": 'attachment; filename="audit.csv"'}
    rows = _as_csv(database, wanted)
    first = await anext(rows)  # a database that does not respond yields a 503 here; later the response would break off
    rows = _with_first(first, rows)
    return StreamingResponse(rows, media_type="text/csv; charset=utf-8", headers=headers)


async def _as_csv(database: Database, wanted: AuditFilter) -> AsyncIterator[str]:
    """Writes the column names before the first page, even if there are no events."""
    names = ",".join(COLUMNS) + "\r\n"
    async for rows in pages(database, wanted, limit=MAX_IN_CSV):
        out = StringIO(names)
        out.seek(0, SEEK_END)
        names = ""
        csv.writer(out).writerows([_cell(row, column) for column in COLUMNS] for row in rows)
        yield out.getvalue()
    if names:
        yield names


async def _with_first(first: str, rest: AsyncIterator[str]) -> AsyncIterator[str]:
    yield first
    async for rows in rest:
        yield rows


def _cell(row: AuditEventRow, column: str) -> str:
    value = getattr(row, column)
    if column == "detail":
        return json.dumps(value, ensure_ascii=False, sort_keys=True)
    text = "" if value is None else value.isoformat() if isinstance(value, datetime) else str(value)
    # A name can begin like a formula; a spreadsheet must not execute it.
    return f"'{text}" if text[:1] in {"=", "+", "-", "@", "\t", "\r"} else text
