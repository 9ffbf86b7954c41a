"""`/api/v1/health` and `/api/v1/health/ready`: for whatever watches over the tower. Tell nothing about anybody."""

from __future__ import annotations

from fastapi import APIRouter, Request
from pydantic import BaseModel

from server.api.dependencies import TowerLockDep
from server.store.database import DatabaseUnavailable

router = APIRouter(prefix="/api/v1", tags=["health"])


class Health(BaseModel):
    status: str
    version: str


@router.get("/health")
async def health(request: Request) -> Health:
    """Answers while the tower runs, whatever the database does: a restart would not mend that. A tower that waits for
    another one's end says `standby`."""
    return Health(status="ok", version=request.app.version)


@router.get("/health/ready", operation_id="ready")
async def ready(request: Request, lock: TowerLockDep) -> Health:
    """Whether the tower can do everything: the database took its last write, half a second ago. 503 where not."""
    if not lock.is_renewed:
        raise DatabaseUnavailable("the database accepts no writes: flights go on, and nothing can be changed")
    return Health(status="ok", version=request.app.version)
