"""`/api/v1/health` and `/api/v1/health/ready`: for monitoring. They reveal nothing about users or drones."""

from __future__ import annotations

from fastapi import APIRouter, Request
from pydantic import BaseModel

from server.http.dependencies import HubDep, TowerLockDep
from server.kernel.tower_refusals import TowerDraining
from server.storage.database import DatabaseUnavailable

router = APIRouter(prefix="/api/v1", tags=["health"])


class Health(BaseModel):
    status: str
    version: str


@router.get("/health")
async def health(request: Request) -> Health:
    """Answers while the tower runs, whatever the state of the database: a restart would not repair that. A tower that
    waits for another one to end reports `standby`."""
    return Health(status="ok", version=request.app.version)


@router.get("/health/ready", operation_id="ready")
async def ready(request: Request, lock: TowerLockDep, hub: HubDep) -> Health:
    """Tells whether the tower is fully operational: the database accepted its last write, half a second ago. 503
    otherwise, and while it ends its work (`tower drain`)."""
    if not lock.is_renewed:
        raise DatabaseUnavailable("the database accepts no writes: flights go on, and nothing can be changed")
    if not hub.takes_browsers:
        raise TowerDraining("this tower ends its work: others have its drones")
    return Health(status="ok", version=request.app.version)
