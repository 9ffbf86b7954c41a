"""`/api/v1/health`: for whatever watches over the tower. Tells nothing about anybody."""

from __future__ import annotations

from fastapi import APIRouter, Request
from pydantic import BaseModel

from server.api.dependencies import DatabaseDep
from server.store.fleet.snapshot import read_revision

router = APIRouter(prefix="/api/v1", tags=["health"])


class Health(BaseModel):
    status: str
    version: str


@router.get("/health")
async def health(request: Request, database: DatabaseDep) -> Health:
    """Answers once the tower is up and its database answers."""
    async with database.reading() as session:
        await read_revision(session)
    return Health(status="ok", version=request.app.version)
